"""Rendered images, the recording on disk, and its truth."""
