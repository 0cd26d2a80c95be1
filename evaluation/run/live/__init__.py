"""Recordings played at their own rate, as live robots would feed the pipeline."""
