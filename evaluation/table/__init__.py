"""Rows of results, their statistics, and the truth that they are measured against."""
