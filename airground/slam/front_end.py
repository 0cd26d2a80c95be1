"""The seam through which poses enter the pipeline (Sec. IV).

A front end eats the sensor messages of one robot and says, for every image, where the
camera was. Visual SLAM, a trajectory file and an oracle all look the same from here.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol, TypeVar

import numpy as np

from airground.core.arrays import F32, F64, Mask, read_only
from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory


class Tracking(Enum):
    """How a front end got on with one image."""

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
        pixels: (N, 2) float32 where they are [px].
        mapped: (N,) whether each is in the map, so that it counts for the pose.
    """

    pixels: F32
    mapped: Mask

    def __post_init__(self) -> None:
        pixels = read_only(self.pixels, "pixels", (None, 2), np.float32)
        object.__setattr__(self, "pixels", pixels)
        object.__setattr__(self, "mapped", read_only(self.mapped, "mapped", (len(pixels),), bool))


@dataclass(frozen=True, eq=False)
class TrackedPose:
    """Where the camera was when one image was taken.

    Attributes:
        stamp_ns: Of the image.
        tracking: Whether the pose can be used.
        T_map_camera: The camera in the robot's own map (`mav` or `ground`): metric, z up
            against gravity. None unless tracked.
        covariance: (6, 6) of the pose error in the map's axes: position [m], then rotation
            vector of estimate times inverse truth [rad]. None where the front end has none.
        scale: How well the metric scale is known; None where depth or a file gives it.
        depth_range: Nearest and farthest map point in this image, along the optical axis
            [m] (Sec. VIII-B). None where the front end has no map.
        corrected: Whether the map changed with this image, and earlier poses with it:
            `FrontEnd.trajectory` has them.
        corners: What was followed into the image, to look at; None where the front end
            follows nothing, or is another process.
    """

    stamp_ns: int
    tracking: Tracking
    T_map_camera: SE3 | None
    covariance: F64 | None = None
    scale: ScaleEstimate | None = None
    depth_range: tuple[float, float] | None = None
    corrected: bool = False
    corners: TrackedCorners | None = None

    def __post_init__(self) -> None:
        if (self.tracking is Tracking.TRACKED) != (self.T_map_camera is not None):
            raise ValueError("a pose is there exactly when the image was tracked")
        if self.covariance is not None:
            covariance = read_only(self.covariance, "covariance", (6, 6), np.float64)
            object.__setattr__(self, "covariance", covariance)


Image_contra = TypeVar("Image_contra", MavImage, GroundImage, contravariant=True)


class FrontEnd(Protocol[Image_contra]):
    """Poses of one robot, one image at a time."""

    def add_imu(self, samples: ImuSamples) -> None:
        """Take the inertial measurements up to the next image."""

    def track(self, image: Image_contra) -> TrackedPose:
        """Where the camera was when `image` was taken."""

    def finish(self) -> None:
        """There are no more images: optimize what was put off."""

    def trajectory(self) -> Trajectory | None:
        """Every image tracked so far, at the pose that is believed now; None before the first.

        Live poses, once returned by `track`, stay as they are; these follow corrections.
        """
