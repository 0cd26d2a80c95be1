"""Damaged inputs by the thousand: each is read as a command reads it, within time and memory."""
