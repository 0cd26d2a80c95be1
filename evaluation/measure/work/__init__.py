"""Work in keyed units: each is measured once, kept, and spread over processes or machines."""
