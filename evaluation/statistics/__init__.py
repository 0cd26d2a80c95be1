"""Intervals that keep failures, and comparisons of two sets of results."""
