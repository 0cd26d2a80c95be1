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

MAX_GAP_NS = 50_000_000
"""A pose is interpolated between two true ones that are at most this far apart."""
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
            return (
                truth.T_world_mav_camera
                if recording.robot == Source.MAV
                else truth.T_world_ground_camera
            )
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
    def at(stamp_ns: int) -> SE3 | None:
        after = int(np.searchsorted(poses.stamps_ns, stamp_ns))
        if after == len(poses) or (after == 0 and poses.stamps_ns[0] != stamp_ns):
            return None
        if poses.stamps_ns[after] - poses.stamps_ns[max(after - 1, 0)] > MAX_GAP_NS:
            return None
        return poses.at(stamp_ns) @ T_pose_camera

    return at
