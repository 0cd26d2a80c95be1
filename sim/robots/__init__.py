"""Motion of both robots: paths through waypoints, dynamics, and the views along them."""
