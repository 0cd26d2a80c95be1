"""An hour of recorded flight in laps, and what a run over it holds in memory."""
