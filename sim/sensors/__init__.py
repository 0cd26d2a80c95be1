"""Faults of real sensors: noise, blur, drift and miscalibration, by preset."""
