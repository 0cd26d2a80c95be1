"""The shipped pipeline over one recording, live or not, one robot alone or both."""
