"""Statistics of what one robot recorded: motion, overlap of its images, light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.core.se3 import SE3
from airground.io.robot_recording import RobotRecording
from evaluation.datasets.gallery.overlap import HALVINGS, points_camera, share_inside, small
from evaluation.table.true_camera import true_camera
from sim.recording.truth import Truth

SAMPLES = 12
"""Images that are read, spread evenly over the recording."""
LATER_NS = 1_000_000_000
"""Overlap is that of an image with the one a second later [ns]: keyframes are about that far
apart."""
DARK, WHITE = 16, 250
"""Grey levels: noise hides corners below the first; a sensor saturates from the second on."""
SPEED_STEP_NS = 90_000_000
"""Speeds are means over this time [ns] or a little more: three images at 30 Hz, over which truth by
motion capture is smooth."""
MOVING_M_S, MOVING_DEG_S = 0.02, 1.0
"""A camera that is slower in both is at rest: truth by motion capture wavers by less."""


@dataclass(frozen=True, eq=False)
class Sample:
    """An image that was read.

    Attributes:
        time_s: Since the recording's first image of this robot [s].
        pixels: (H, W) grey or (H, W, 3) RGB uint8.
        depth: (H, W) float32 measured depth [m], NaN where missing; None without.
    """

    time_s: float
    pixels: NDArray[np.uint8]
    depth: NDArray[np.float32] | None

    def grey(self) -> NDArray[np.uint8]:
        if self.pixels.ndim == 2:
            return self.pixels
        return np.asarray(cv2.cvtColor(self.pixels, cv2.COLOR_RGB2GRAY), np.uint8)


@dataclass(frozen=True, eq=False)
class Recorded:
    """What one robot recorded, in numbers.

    Attributes:
        robot: "mav" or "ground".
        images, duration_s: Number of its images, and time from the first to the last [s].
        samples: Images spread evenly over the recording.
        path_world: (N, 3) true positions of the camera at its images [m], rows of NaN where
            unknown; None without truth.
        speed_m_s: (M,) speeds of the camera in motion [m/s]; empty without truth.
        turn_deg_s: (M,) rates of rotation [deg/s], by truth and in motion, or else by the gyro;
            empty without.
        overlap: (K,) share of an image's pixels that the image a second later shows, too, if the
            camera has moved; empty without truth or depth.
        mean_grey, dark, white: (SAMPLES,) mean grey level, and shares of the pixels that are
            darker than `DARK` or at least `WHITE`.
    """

    robot: str
    images: int
    duration_s: float
    samples: tuple[Sample, ...]
    path_world: NDArray[np.float64] | None
    speed_m_s: NDArray[np.float64]
    turn_deg_s: NDArray[np.float64]
    overlap: NDArray[np.float64]
    mean_grey: NDArray[np.float64]
    dark: NDArray[np.float64]
    white: NDArray[np.float64]

    @property
    def path_m(self) -> float:
        """Length of the path [m]; NaN without truth."""
        if self.path_world is None:
            return float("nan")
        steps = np.diff(self.path_world[np.isfinite(self.path_world).all(axis=1)], axis=0)
        return float(np.linalg.norm(steps, axis=1).sum())


def look_at(recording: RobotRecording[Any]) -> Recorded:
    """Read some images of a recording, and all of its poses.

    Raises:
        AirgroundError: An image or the truth is damaged.
    """
    true_pose = true_camera(recording)
    stamps = recording.camera_stamps
    poses = [true_pose(int(stamp)) if true_pose else None for stamp in stamps]
    surface = _surface(recording) if true_pose else None
    camera = small(recording.calibration.camera)
    samples, overlap = [], []
    for index in np.unique(np.linspace(0, len(stamps) - 1, SAMPLES).astype(int)).tolist():
        image, pose = recording.read_image(index), poses[index]
        depth = _measured(recording, index, image)
        if pose is not None:
            shrunk = surface(camera, pose) if surface else _shrunk(depth, camera)
            later = int(np.searchsorted(stamps, stamps[index] + LATER_NS))
            next_pose = poses[later] if later < len(stamps) else None
            if shrunk is not None and next_pose is not None and moves(pose, next_pose, 1.0):
                points = pose @ points_camera(camera, shrunk)
                overlap.append(share_inside(points, camera, next_pose))
        pixels = image.colour if isinstance(image, GroundImage) else image.image
        time_s = float(stamps[index] - stamps[0]) / 1e9
        samples.append(Sample(time_s, pixels, depth))
    greys = [sample.grey() for sample in samples]
    speed, turn = motion(stamps, poses) if true_pose else (np.zeros(0), _gyro_rate(recording))
    return Recorded(
        robot=recording.robot.name.lower(),
        images=len(stamps),
        duration_s=recording.duration_s,
        samples=tuple(samples),
        path_world=_positions(poses) if true_pose else None,
        speed_m_s=speed,
        turn_deg_s=turn,
        overlap=np.array(overlap),
        mean_grey=np.array([grey.mean() for grey in greys]),
        dark=np.array([(grey < DARK).mean() for grey in greys]),
        white=np.array([(grey >= WHITE).mean() for grey in greys]),
    )


def moves(before: SE3, after: SE3, seconds: float) -> bool:
    """Whether a camera is in motion between two of its poses."""
    moved = before.inverse() @ after
    speed_m_s = np.linalg.norm(moved.translation) / seconds
    return bool(speed_m_s >= MOVING_M_S or np.rad2deg(moved.angle()) / seconds >= MOVING_DEG_S)


def _shrunk(depth: NDArray[np.float32] | None, camera: PinholeCamera) -> NDArray[np.float32] | None:
    """Depth at the pixels of the smaller camera: no mean, which would bridge edges."""
    if depth is None:
        return None
    step = 2**HALVINGS
    return depth[step // 2 :: step, step // 2 :: step][: camera.height, : camera.width]


def _measured(
    recording: RobotRecording[Any], index: int, image: MavImage | GroundImage
) -> NDArray[np.float32] | None:
    if isinstance(image, GroundImage):
        return image.depth
    return None if recording.read_depth is None else recording.read_depth(index)


Surface = Callable[[PinholeCamera, SE3], NDArray[np.float32]]


def _surface(recording: RobotRecording[Any]) -> Surface | None:
    """True depth that a camera would see; None where only measured depth is known."""
    if recording.layout != "airground":
        return None
    truth = Truth.open(recording.path)
    return truth.surface("mav" if recording.robot == Source.MAV else "ground").cast


def _positions(poses: list[SE3 | None]) -> NDArray[np.float64]:
    unknown = np.full(3, np.nan)
    return np.array([unknown if pose is None else pose.translation for pose in poses])


def motion(
    stamps: NDArray[np.int64], poses: list[SE3 | None]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Speeds [m/s] and rates of rotation [deg/s] of a camera in motion, between images
    `SPEED_STEP_NS` apart or more."""
    speeds, turns, last = [], [], 0
    for index, pose in enumerate(poses):
        if index and stamps[index] - stamps[last] < SPEED_STEP_NS:
            continue
        before, seconds = poses[last], float(stamps[index] - stamps[last]) / 1e9
        if index and pose is not None and before is not None and moves(before, pose, seconds):
            moved = before.inverse() @ pose
            speeds.append(float(np.linalg.norm(moved.translation)) / seconds)
            turns.append(float(np.rad2deg(moved.angle())) / seconds)
        last = index
    return np.array(speeds), np.array(turns)


def _gyro_rate(recording: RobotRecording[Any]) -> NDArray[np.float64]:
    """(M,) rates of rotation [deg/s], its bias included; empty without an IMU."""
    if recording.imu is None:
        return np.zeros(0)
    return np.rad2deg(np.linalg.norm(recording.imu.gyro, axis=1))
