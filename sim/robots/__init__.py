"""How both robots move: paths, dynamics, motion."""
