"""Sweeps: what is measured when a dial is turned."""
