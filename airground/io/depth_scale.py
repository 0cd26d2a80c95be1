"""The value of one metre in a depth image: given, stated by a calibration, or by the format.

What the format says is checked against the images: a sensor sees neither the tip of its lens nor
the far end of a street."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airground.core.arrays import U16, Floats
from airground.errors import RecordingError

COMMON_UNITS_PER_M = (1000.0, 5000.0)
"""Millimetres (ROS, Kinect, RealSense, 7-Scenes) and TUM RGB-D's unit."""
NEAREST_M = 0.25
"""Depth cameras measure from 0.3 m (RealSense) or 0.4 m (Kinect) on: at most one value in twenty is
less."""
MIDDLE_M = 0.45
"""Least median depth of a recording: a camera does not keep to its near limit [m]."""
FARTHEST_M = 10.0
"""Depth cameras of robots reach less far: at most one value in twenty is more [m]."""
QUANTILES = (0.05, 0.5, 0.95)
SAMPLES = 5
"""Images that are looked at, spread evenly."""


@dataclass(frozen=True)
class DepthScale:
    """Value of one metre, and whether the recording or its user states it."""

    units_per_m: float
    stated: bool

    def check(self, values: U16, path: Path) -> None:
        """RecordingError where a scale that nothing states does not fit, and another one does.

        Args:
            values: (N,) values of pixels with depth.
            path: The file or folder that the values are from, for the message.
        """
        better = None if self.stated else better_scale(values, self.units_per_m)
        if better is not None:
            depth_m = float(np.median(values)) / self.units_per_m
            raise RecordingError(
                f"{path}: the median depth is {depth_m:.2f} m at {self.units_per_m:g} per metre; "
                f"it looks like {better:g} per metre; give --depth-scale {better:g}, or "
                f"{self.units_per_m:g} if that is right"
            )


def better_scale(values: U16, units_per_m: float) -> float | None:
    """A common scale that fits values (N,) where `units_per_m` does not; None otherwise."""
    if len(values) == 0 or plausible(values / units_per_m):
        return None
    others = (scale for scale in COMMON_UNITS_PER_M if scale != units_per_m)
    return next((scale for scale in others if plausible(values / scale)), None)


def plausible(depth_m: Floats) -> bool:
    """Whether depths (N,) [m], N > 0, can be those of a robot's depth camera."""
    near_m, middle_m, far_m = np.quantile(depth_m, QUANTILES)
    return bool(near_m >= NEAREST_M and middle_m >= MIDDLE_M and far_m <= FARTHEST_M)
