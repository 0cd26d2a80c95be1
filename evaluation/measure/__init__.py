"""Many recordings measured: protocol, baselines, sweeps, and the work spread over processes."""
