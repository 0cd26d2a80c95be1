"""One flight looked at closely: the data that pictures are drawn from."""
