"""Who claims to know, who is wrong, and whether the spread says so."""
