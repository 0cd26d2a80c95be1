"""The interface through which poses enter the pipeline (Sec. IV).

A front end takes the sensor messages of one robot and returns the camera's pose for every
image. Visual SLAM, a trajectory file and an oracle have the same interface.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol, TypeVar

import numpy as np

from airground.core.arrays import F32, F64, Mask, freeze
from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory


class Tracking(Enum):
    """Result of a front end for one image."""

    INITIALIZING = "initializing"
    TRACKED = "tracked"
    LOST = "lost"


@dataclass(frozen=True)
class ScaleEstimate:
    """How well the metric scale of a map is known.

    Attributes:
        sigma: Standard deviation of the scale, as a share of it.
        observable: Whether the motion so far makes scale observable at all.
    """

    sigma: float
    observable: bool


@dataclass(frozen=True, eq=False)
class TrackedCorners:
    """Corners that were followed into one image.

    Attributes:
        pixels: (N, 2) float32 pixels of the corners [px].
        mapped: (N,) bool, whether a corner is in the map and so counts for the pose.
    """

    pixels: F32
    mapped: Mask

    def __post_init__(self) -> None:
        freeze(self, "pixels", (None, 2), np.float32)
        freeze(self, "mapped", (len(self.pixels),), np.bool_)


@dataclass(frozen=True, eq=False)
class TrackedPose:
    """The camera's pose at one image.

    Attributes:
        stamp_ns: Stamp of the image [ns].
        tracking: Whether the pose can be used.
        T_map_camera: Pose of the camera in the robot's own map (`mav` or `ground`): metric, z up
            against gravity. None unless tracked.
        covariance: (6, 6) covariance of the error in the map's axes: position [m], then rotation
            vector of estimate times inverse truth [rad]. None where the front end has none.
        scale: How well the metric scale is known; None where depth or a file gives it.
        depth_range: Nearest and farthest map point in this image, along the optical axis
            [m] (Sec. VIII-B). None where the front end has no map.
        corrected: Whether this image changed the map and earlier poses, which
            `FrontEnd.trajectory` returns.
        corners: Corners followed into the image, for display; None where the front end has
            none, or runs in another process.
        waiting: What a front end without a map waits for and how far it got, in words; empty
            otherwise, and where the front end runs in another process.
    """

    stamp_ns: int
    tracking: Tracking
    T_map_camera: SE3 | None
    covariance: F64 | None = None
    scale: ScaleEstimate | None = None
    depth_range: tuple[float, float] | None = None
    corrected: bool = False
    corners: TrackedCorners | None = None
    waiting: str = ""

    def __post_init__(self) -> None:
        if (self.tracking is Tracking.TRACKED) != (self.T_map_camera is not None):
            raise ValueError("a pose is there exactly when the image was tracked")
        if self.covariance is not None:
            freeze(self, "covariance", (6, 6), np.float64)


class PoseLog:
    """The poses that a front end has given, in order of time, for one that never corrects them."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._poses: list[SE3] = []

    def tracked(self, stamp_ns: int, T_map_camera: SE3) -> TrackedPose:
        """Note a pose, and return it as a front end does."""
        self._stamps.append(stamp_ns)
        self._poses.append(T_map_camera)
        return TrackedPose(stamp_ns, Tracking.TRACKED, T_map_camera)

    def trajectory(self) -> Trajectory | None:
        """Every pose noted; None before the first."""
        return Trajectory.from_poses(self._stamps, self._poses) if self._poses else None


Image_contra = TypeVar("Image_contra", MavImage, GroundImage, contravariant=True)


class FrontEnd(Protocol[Image_contra]):
    """Poses of one robot, one image at a time."""

    def add_imu(self, samples: ImuSamples) -> None:
        """Take the inertial measurements up to the next image."""

    def track(self, image: Image_contra) -> TrackedPose:
        """The pose of the camera at `image`."""

    def finish(self) -> None:
        """Finish after the last image: run deferred optimization."""

    def trajectory(self) -> Trajectory | None:
        """The newest poses of all images tracked so far, corrections included, and of images before
        the first of them, where they became known later; None before the first. Poses returned by
        `track` do not change."""
