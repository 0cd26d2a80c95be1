"""What tracking left of a recording."""

from __future__ import annotations

from dataclasses import dataclass

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from evaluation.runs.watched_front_end import FrontEndLog


@dataclass(frozen=True, eq=False)
class Tracked:
    """What a front end left of a recording.

    Attributes:
        robot: "mav" or "ground".
        front_end: What it said, image by image.
        final: The poses that it believed in at the end.
        slam: Whether it was SLAM, whose times mean something.
    """

    robot: str
    front_end: FrontEndLog
    final: Trajectory | None
    slam: bool

    def final_poses(self) -> list[tuple[int, SE3]]:
        if self.final is None:
            return []
        return [(int(stamp), self.final[i]) for i, stamp in enumerate(self.final.stamps_ns)]
