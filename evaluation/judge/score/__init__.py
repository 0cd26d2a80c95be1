"""Scores of submissions: where each says that the MAV was, held against the truth."""
