"""Tracked frames made by hand."""

from __future__ import annotations

import numpy as np

from airground.core.messages import GroundImage, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.front_end import ScaleEstimate, TrackedPose, Tracking
from airground.tracking import TrackedFrame


def path(count: int) -> Trajectory:
    poses = [SE3.from_heading(0.1 * i, [0.3 * i, 0.0, 1.0]) for i in range(count)]
    return Trajectory.from_poses(list(range(count)), poses)


def ground_frame(stamp_ns: int, trajectory: Trajectory | None = None) -> TrackedFrame:
    rng = np.random.default_rng(stamp_ns)
    depth = rng.uniform(1, 4, (12, 16)).astype(np.float32)
    depth[3, 5] = np.nan
    image = GroundImage(stamp_ns, rng.integers(0, 256, (12, 16, 3), np.uint8), depth)
    pose = TrackedPose(stamp_ns, Tracking.TRACKED, SE3.from_heading(0.3, [1, 2, 1e-17]))
    return TrackedFrame(image, pose, None, trajectory)


def mav_frame(stamp_ns: int, sigma: float = 0.1) -> TrackedFrame:
    rng = np.random.default_rng(stamp_ns)
    smooth = np.add.outer(np.arange(24), 2 * np.arange(32)) + rng.integers(0, 9, (24, 32))
    pose = TrackedPose(
        stamp_ns,
        Tracking.TRACKED,
        SE3.from_rotation_vector([0.1, 0.2, 0.3], [1 / 3, 2 / 3, 0.7]),
        np.diag(rng.uniform(1e-6, 1e-4, 6)),
        ScaleEstimate(sigma, True),
        (1 / 7, 22 / 7),
        corrected=True,
    )
    return TrackedFrame(MavImage(stamp_ns, smooth.astype(np.uint8)), pose, 1 / 9)
