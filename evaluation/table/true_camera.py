"""Where a robot's camera really was, for every kind of folder that states it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from airground.core.cloud import Source
from airground.core.se3 import FARTHEST_M, SE3
from airground.core.trajectory import Trajectory
from airground.errors import RecordingError
from airground.io.euroc import read_lines
from airground.io.frame_numbers import SECOND_NS, stamps_of
from airground.io.plain_euroc import euroc_folder
from airground.io.plausibility import rigid
from airground.io.robot_recording import RobotRecording
from airground.io.tum import read_tum

GAP_IN_PERIODS = 1.5
"""Longest gap to interpolate over, in median periods of the truth: jitter, but no missing pose."""
SHORT_GAP_NS, LONG_GAP_NS = 50_000_000, 150_000_000
"""Gaps up to the first are always interpolated, gaps beyond the second never [ns]. A robot that
accelerates by 2 m/s^2 leaves the straight line by 0.6 mm in the first and 5.6 mm in the second."""
SAME_STAMP_NS = 100_000
"""At an end or a gap of the truth, a pose this close holds for a stamp [ns]: TUM files round to
0.1 ms, in which a robot at 1 m/s moves by 0.1 mm."""
UNIT_TOLERANCE = 1e-2
POSES = "frame-*.pose.txt"
POSE_TOLERANCE = 2e-3
"""How far R R^T of such a pose may differ from I: the data set's differ by up to 4e-4."""
EUROC_COLUMNS = 8
"""Stamp, position and quaternion wxyz; velocities and biases follow."""


def true_camera(recording: RobotRecording) -> Callable[[int], SE3 | None] | None:
    """The true camera pose at a stamp [ns], None where it is unknown; None without truth.

    Ours: `truth/`. TUM RGB-D: `groundtruth.txt`, of the camera. 7-Scenes: `frame-*.pose.txt`, of
    the camera. EuRoC: `state_groundtruth_estimate0`, of the body. Bags: none is read.

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
            if not file.exists():
                return None
            return _lookup(_at_stamps(read_tum(file), recording), SE3.identity())
        case "7scenes":
            found = read_numbered_poses(recording.path)
            return _lookup(_at_stamps(found, recording), SE3.identity()) if found else None
        case "ros":
            return None
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
    if not (np.abs(values) < FARTHEST_M).all():
        raise RecordingError(f"{path}: a pose is not finite, or beyond {FARTHEST_M:g} m")
    quaternions = values[:, 3:]
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(quaternions, axis=1)
    off = ~(np.abs(lengths - 1) <= UNIT_TOLERANCE)  # or NaN
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


def read_numbered_poses(folder: Path) -> Trajectory | None:
    """Poses of `frame-000000.pose.txt`, four rows each, by frame number as seconds; None without.
    Frames whose pose is not finite are left out.

    Raises:
        RecordingError: Names the file and what is wrong.
    """
    stamps, poses = [], []
    for file in sorted(folder.glob(POSES)):
        try:
            matrix = np.array([line.split() for line in read_lines(file) if line], np.float64)
            number = int(file.name.split(".")[0].removeprefix("frame-"))
        except ValueError as error:
            raise RecordingError(f"{file}: expected four rows of four numbers: {error}") from None
        if matrix.shape == (4, 4) and not np.isfinite(matrix).all():
            continue
        stamps.append(number * SECOND_NS)
        poses.append(rigid(matrix, file, "pose", POSE_TOLERANCE))
    return Trajectory.from_poses(stamps, poses) if stamps else None


def _at_stamps(poses: Trajectory, recording: RobotRecording) -> Trajectory:
    """Poses whose stamps are frame numbers, at the stamps that the images were given."""
    if recording.frame_rate_hz is None:
        return poses
    stamps_ns = stamps_of(poses.stamps_ns // SECOND_NS, recording.frame_rate_hz)
    return Trajectory(stamps_ns, poses.rotations, poses.translations)


def _lookup(poses: Trajectory, T_pose_camera: SE3) -> Callable[[int], SE3 | None]:
    """The pose at a stamp: a stated one, or interpolated over a gap that is short enough."""
    stamps = poses.stamps_ns
    period_ns = float(np.median(np.diff(stamps))) if len(stamps) > 1 else 0.0
    longest_ns = np.clip(GAP_IN_PERIODS * period_ns, SHORT_GAP_NS, LONG_GAP_NS)

    def at(stamp_ns: int) -> SE3 | None:
        after = int(np.searchsorted(stamps, stamp_ns))
        within = 0 < after < len(stamps) and stamps[after] - stamps[after - 1] <= longest_ns
        if within:
            return poses.at(stamp_ns) @ T_pose_camera
        beside = [index for index in (after - 1, after) if 0 <= index < len(stamps)]
        nearest = min(beside, key=lambda index: abs(int(stamps[index]) - stamp_ns))
        if abs(int(stamps[nearest]) - stamp_ns) > SAME_STAMP_NS:
            return None
        return poses[nearest] @ T_pose_camera

    return at
