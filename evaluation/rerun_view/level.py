"""How much of a run is kept: rates and resolutions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

LevelName = Literal["summary", "stages", "all"]


@dataclass(frozen=True)
class Level:
    """What a recording for the viewer holds of each second.

    Attributes:
        pose_hz: Poses, and points of the curves.
        image_hz: Images of each robot with their corners.
        image_scale: Their size, as a share of the camera's.
        jpeg_quality: Their quality, 1 to 100.
        depth_map_hz: Depth maps and their errors.
        cloud_hz: Both maps, each drawn anew as a whole.
        voxel_m: Points of maps and surfaces are this far apart [m].
    """

    pose_hz: float
    image_hz: float
    image_scale: float
    jpeg_quality: int
    depth_map_hz: float
    cloud_hz: float
    voxel_m: float


LEVELS: dict[LevelName, Level] = {
    "summary": Level(5, 1, 0.5, 70, 0.5, 0.25, 0.05),
    "stages": Level(10, 5, 0.75, 75, 2, 0.5, 0.03),
    "all": Level(30, 30, 1.0, 75, 30, 0.5, 0.025),
}


class Pace:
    """Lets through so many a second, by sensor time.

    Args:
        hz: How many.
    """

    def __init__(self, hz: float) -> None:
        # Half a frame of 30 Hz early is in time: frames do not come at whole multiples.
        self._apart_ns = round(1e9 / hz) - 16_000_000
        self._last_ns: int | None = None

    def due(self, stamp_ns: int) -> bool:
        """Whether enough time has passed; if so, the next wait begins."""
        if self._last_ns is not None and stamp_ns - self._last_ns < self._apart_ns:
            return False
        self._last_ns = stamp_ns
        return True
