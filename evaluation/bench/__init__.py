"""`airground bench`: Table I on this machine, beside the paper, other libraries and the floor."""
