"""Sensors that fail while a robot is tracked, and what becomes of its poses."""
