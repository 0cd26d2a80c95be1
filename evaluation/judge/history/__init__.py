"""Accuracy over revisions: points, and steps between them."""
