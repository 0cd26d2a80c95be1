"""Files that say where the MAV is relative to the ground robot: the answers of a benchmark.

A line is `timestamp tx ty tz qx qy qz qw [claim]`: the stamp of an image of the MAV in seconds,
and the pose of the MAV's camera in the ground robot's camera at that time. Without the claim, 0
or 1, the pose is claimed. Spaces separate the values, in `.csv` commas.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import RecordingError
from airground.io.euroc import read_lines
from airground.io.tum import format_stamp, parse_pose

COLUMNS = "timestamp tx ty tz qx qy qz qw [claim]"
ENDINGS = (".tum", ".txt", ".csv")
MOST_ROWS = 200_000
"""More than an hour at 50 Hz: more is no answer to a flight of minutes."""


@dataclass(frozen=True, eq=False)
class Answers:
    """Poses of the MAV's camera in the ground robot's camera.

    Attributes:
        poses: `T_ground_camera_mav_camera` by stamps of the MAV's images.
        claimed: (N,) whether each pose is claimed.
    """

    poses: Trajectory
    claimed: NDArray[np.bool_]

    def claims(self) -> list[tuple[int, SE3]]:
        """Stamps [ns] and poses of those that are claimed."""
        stamps = self.poses.stamps_ns.tolist()
        return [(stamps[i], self.poses[i]) for i in np.flatnonzero(self.claimed).tolist()]


def read_answers(path: Path) -> Answers:
    """Read a file; RecordingError names the file, the line and what would be right."""
    commas = path.suffix == ".csv"
    stamps: list[int] = []
    poses: list[SE3] = []
    claimed: list[bool] = []
    for number, line in enumerate(read_lines(path), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        where = f"{path}:{number}"
        fields = [field.strip() for field in line.split(",")] if commas else line.split()
        if len(fields) not in (8, 9):
            raise RecordingError(f"{where}: expected '{COLUMNS}', got {len(fields)} fields")
        if fields[8:] not in ([], ["0"], ["1"]):
            raise RecordingError(f"{where}: the claim must be 0 or 1, got '{fields[8][:20]}'")
        stamp, pose = parse_pose(fields[:8], where)
        if stamps and stamp <= stamps[-1]:
            raise RecordingError(
                f"{where}: time {fields[0]} s does not follow {format_stamp(stamps[-1])} s; times "
                "must strictly increase"
            )
        if len(stamps) == MOST_ROWS:
            raise RecordingError(f"{where}: expected at most {MOST_ROWS} lines")
        stamps.append(stamp)
        poses.append(pose)
        claimed.append(fields[8:] != ["0"])
    if not stamps:
        raise RecordingError(f"{path}: holds no pose; leave the file out to claim nothing")
    return Answers(Trajectory.from_poses(stamps, poses), np.array(claimed, bool))


def write_answers(path: Path, answers: Sequence[tuple[int, SE3]]) -> None:
    """Write claimed poses, by stamps [ns]."""
    lines = ["# timestamp tx ty tz qx qy qz qw claim"]
    for stamp, pose in answers:
        values = " ".join(f"{v:.9f}" for v in (*pose.translation, *pose.quaternion_xyzw()))
        lines.append(f"{format_stamp(stamp)} {values} 1")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
