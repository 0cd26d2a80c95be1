"""Ranges of what calibrations state, wide enough for any sensor of a robot.

A number beyond is a mistake of unit or a damaged file; some would overflow later on.
"""

from __future__ import annotations

MIN_FOCAL_PX, MAX_FOCAL_PX = 1.0, 1e6
"""Focal length: of a lens that sees half a sphere in one pixel, and of a telescope [px]."""
MIN_RATE_HZ, MAX_RATE_HZ = 1e-3, 1e5
"""Rate of a sensor [Hz]."""
MIN_NOISE, MAX_NOISE = 1e-15, 100.0
"""Noise of an inertial sensor: density or walk, in its own unit. The density of a gyro for
navigation is 1e-8 [rad/s/sqrt(Hz)]."""
MIN_BIAS_MPS2, MAX_BIAS_MPS2 = 1e-6, 100.0
"""Standard deviation of an accelerometer's bias [m/s^2]."""
MIN_FIELD_NOISE_T, MAX_FIELD_NOISE_T = 1e-15, 0.1
"""Noise of a magnetometer's sample [T]."""
MIN_UNITS_PER_M, MAX_UNITS_PER_M = 1e-3, 1e6
"""Value of one metre of depth: of kilometres and of micrometres."""
MAX_OFFSET_NS = 86_400_000_000_000
"""Largest offset between two clocks of a robot, a day [ns]."""
MAX_TURN_SIGMA_RAD = 3.2
"""Standard deviation of an unknown mounting [rad]."""
MAX_SCALE_SIGMA = 1.0
"""Relative standard deviation of an unknown depth scale."""
