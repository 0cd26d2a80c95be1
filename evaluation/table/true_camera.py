"""Where a robot's camera really was, for every kind of folder that states it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from airground.core.cloud import Source
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import RecordingError
from airground.io.euroc import read_lines
from airground.io.plain_euroc import euroc_folder
from airground.io.robot_recording import RobotRecording
from airground.io.tum import read_tum

GAP_IN_PERIODS = 1.5
"""Longest gap to interpolate over, in median periods of the truth: jitter, but no missing pose."""
SHORT_GAP_NS, LONG_GAP_NS = 50_000_000, 150_000_000
"""Gaps up to the first are always interpolated, gaps beyond the second never [ns]. A robot that
accelerates by 2 m/s^2 leaves the straight line by 0.6 mm in the first and 5.6 mm in the second."""
UNIT_TOLERANCE = 1e-2
EUROC_COLUMNS = 8
"""Stamp, position and quaternion wxyz; velocities and biases follow."""


def true_camera(recording: RobotRecording) -> Callable[[int], SE3 | None] | None:
    """The true camera pose at a stamp [ns], None where it is unknown; None without truth.

    Ours: `truth/`. TUM RGB-D: `groundtruth.txt`, of the camera. EuRoC:
    `state_groundtruth_estimate0`, of the body.

    Raises:
        AirgroundError: The truth is there, but damaged.
    """
    match recording.layout:
        case "airground":
            from sim.recording.truth import Truth

            if not (recording.path / "truth").is_dir():
                return None
            truth = Truth.open(recording.path)
            is_mav = recording.robot == Source.MAV
            return truth.T_world_mav_camera if is_mav else truth.T_world_ground_camera
        case "tum":
            file = recording.path / "groundtruth.txt"
            return _lookup(read_tum(file), SE3.identity()) if file.exists() else None
        case _:
            folder = euroc_folder(recording.path)
            assert folder is not None
            file = folder / "state_groundtruth_estimate0" / "data.csv"
            if not file.exists():
                return None
            return _lookup(read_euroc_poses(file), recording.T_pose_camera)


def read_euroc_poses(path: Path) -> Trajectory:
    """Poses from a table of EuRoC's with stamp [ns], position [m] and quaternion wxyz.

    Raises:
        RecordingError: Names the file and what is wrong.
    """
    lines = [line.split(",") for line in read_lines(path) if line and not line.startswith("#")]
    try:
        stamps = np.array([int(fields[0]) for fields in lines], np.int64)
        values = np.array([fields[1:EUROC_COLUMNS] for fields in lines], np.float64)
        values = values.reshape(-1, EUROC_COLUMNS - 1)
    except (ValueError, OverflowError) as error:
        raise RecordingError(f"{path}: expected stamp, x, y, z, qw, qx, qy, qz: {error}") from None
    quaternions = values[:, 3:]
    off = ~(np.abs(np.linalg.norm(quaternions, axis=1) - 1) <= UNIT_TOLERANCE)  # or NaN
    if off.any():
        raise RecordingError(
            f"{path}: the quaternion (qw qx qy qz) at stamp {stamps[np.argmax(off)]} must have "
            "length 1"
        )
    rotations = Rotation.from_quat(np.roll(quaternions, -1, axis=1)).as_matrix()
    try:
        return Trajectory(stamps, rotations, values[:, :3])
    except ValueError as error:
        raise RecordingError(f"{path}: {error}") from None


def _lookup(poses: Trajectory, T_pose_camera: SE3) -> Callable[[int], SE3 | None]:
    """The pose at a stamp: a stated one, or interpolated over a gap that is short enough."""
    stamps = poses.stamps_ns
    period_ns = float(np.median(np.diff(stamps))) if len(stamps) > 1 else 0.0
    longest_ns = np.clip(GAP_IN_PERIODS * period_ns, SHORT_GAP_NS, LONG_GAP_NS)

    def at(stamp_ns: int) -> SE3 | None:
        after = int(np.searchsorted(stamps, stamp_ns))
        if after < len(stamps) and stamps[after] == stamp_ns:
            return poses[after] @ T_pose_camera
        if after in (0, len(stamps)) or stamps[after] - stamps[after - 1] > longest_ns:
            return None
        return poses.at(stamp_ns) @ T_pose_camera

    return at
