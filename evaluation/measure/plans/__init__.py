"""Plans: which flights and setups, and how much of each: reproduction, suite, sweeps."""
