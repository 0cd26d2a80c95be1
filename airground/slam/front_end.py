"""The seam through which poses enter the pipeline (Sec. IV).

A front end eats the sensor messages of one robot and says, for every image, where the
camera was. Visual SLAM, a trajectory file and an oracle all look the same from here.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Protocol, TypeVar

from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3


class Tracking(Enum):
    """How a front end got on with one image."""

    INITIALIZING = "initializing"
    TRACKED = "tracked"
    LOST = "lost"


@dataclass(frozen=True)
class TrackedPose:
    """Where the camera was when one image was taken.

    Attributes:
        stamp_ns: Of the image.
        tracking: Whether the pose can be used.
        T_map_camera: The camera in the robot's own map (`mav` or `ground`): metric, z up
            against gravity. None unless tracked.
    """

    stamp_ns: int
    tracking: Tracking
    T_map_camera: SE3 | None


Image_contra = TypeVar("Image_contra", MavImage, GroundImage, contravariant=True)


class FrontEnd(Protocol[Image_contra]):
    """Poses of one robot, one image at a time."""

    def add_imu(self, samples: ImuSamples) -> None:
        """Take the inertial measurements up to the next image."""

    def track(self, image: Image_contra) -> TrackedPose:
        """Where the camera was when `image` was taken."""
