"""How many of its images a robot was tracked in, and since when it moved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.messages import ImuNoise, ImuSamples
from airground.core.se3 import SE3
from airground.io.robot_recording import RobotRecording
from airground.slam.front_end import TrackedPose, Tracking
from airground.slam.inertial.stationarity import at_rest

TruePose = Callable[[int], SE3 | None]

MOVED_M, MOVED_RAD = 0.02, np.deg2rad(1.0)
"""A camera that is farther from its first pose has moved: several times what truth by motion
capture wavers, and what a robot covers in the first tenths of a second."""
AT_ONCE_NS = 500_000_000
"""A recording in which the camera moved this early begins in motion [ns]."""
WINDOW_NS, STEP_NS = 1_000_000_000, 100_000_000
"""An IMU is at rest over one second or not at all; windows begin a tenth of a second apart."""


@dataclass(frozen=True)
class TrackedShare:
    """How far a robot was tracked; see `tracked_share`.

    Attributes:
        fraction: Share of the images with a pose, from the first motion on.
        first_pose_s: Seconds from the first image to the first with a pose; NaN without any.
        lost_images: Number of images without a pose after the first that had one.
    """

    fraction: float
    first_pose_s: float
    lost_images: int


def tracked_share(answers: Sequence[TrackedPose], motion_ns: int) -> TrackedShare:
    """The share of images that have a pose, over all images from the first motion on.

    This is the one definition of "tracked". A robot at rest needs no pose, so that images before
    its first motion do not count, with a pose or without. Every image after that counts: those
    before the first pose and those after tracking was lost. The wait for the first pose is
    stated beside it. Images that a live run dropped were never tracked and are counted apart.

    Args:
        answers: One per image, in order of time.
        motion_ns: Stamp from which on images count (`first_motion_ns`) [ns].
    """
    posed = np.array([answer.tracking is Tracking.TRACKED for answer in answers], np.bool_)
    if not posed.any():
        return TrackedShare(0.0, float("nan"), 0)
    first = int(np.argmax(posed))
    counted = posed[[answer.stamp_ns >= motion_ns for answer in answers]]
    return TrackedShare(
        fraction=float(counted.mean()),
        first_pose_s=(answers[first].stamp_ns - answers[0].stamp_ns) * 1e-9,
        lost_images=int((~posed[first:]).sum()),
    )


def tracked_share_of(
    recording: RobotRecording, answers: Sequence[TrackedPose], true_pose: TruePose | None
) -> TrackedShare:
    """`tracked_share` of one robot's recording, with truth or without."""
    noise = recording.calibration.imu
    motion_ns = first_motion_ns(recording.camera_stamps, true_pose, recording.imu, noise)
    return tracked_share(answers, motion_ns)


def first_motion_ns(
    stamps_ns: NDArray[np.int64],
    true_pose: TruePose | None,
    imu: ImuSamples | None = None,
    noise: ImuNoise | None = None,
) -> int:
    """The stamp of the first image after which the robot had moved [ns].

    The true poses say so or, where the first of them is unknown, the IMU. A recording that
    begins in motion, that never moves or of which neither is known counts from its first image.

    Args:
        stamps_ns: (N,) stamps of the images, N >= 1.
        true_pose: True camera pose at a stamp, None where it is unknown.
        imu: Inertial samples; None without.
        noise: Noise of the inertial sensor; None without.
    """
    first_ns = int(stamps_ns[0])
    start = true_pose(first_ns) if true_pose is not None else None
    if true_pose is not None and start is not None:
        moved_ns = next((t for t in stamps_ns.tolist() if _moved(start, true_pose(t))), first_ns)
    elif imu is not None and noise is not None:
        moved_ns = _shaken_ns(stamps_ns, imu, noise)
    else:
        return first_ns
    return moved_ns if moved_ns - first_ns > AT_ONCE_NS else first_ns


def _moved(start: SE3, pose: SE3 | None) -> bool:
    if pose is None:
        return False
    motion = start.inverse() @ pose
    return bool(np.linalg.norm(motion.translation) > MOVED_M or motion.angle() > MOVED_RAD)


def _shaken_ns(stamps_ns: NDArray[np.int64], imu: ImuSamples, noise: ImuNoise) -> int:
    """The end of the last window in which the IMU was at rest without a break; else the start."""
    first_ns, last_ns = int(stamps_ns[0]), int(stamps_ns[-1])
    for begin_ns in range(first_ns, last_ns - WINDOW_NS, STEP_NS):
        if at_rest(imu.between(begin_ns, begin_ns + WINDOW_NS), noise) is None:
            return begin_ns - STEP_NS + WINDOW_NS if begin_ns > first_ns else first_ns
    return first_ns
