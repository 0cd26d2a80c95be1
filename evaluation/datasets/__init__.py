"""Recordings in the field's formats, with the truth in each format's own place."""
