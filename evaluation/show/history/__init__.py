"""Accuracy over revisions, as a page and for dashboards."""
