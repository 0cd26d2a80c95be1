"""What both cameras see, and the corners that tracking follows in it."""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
import rerun as rr
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.cloud import Source
from airground.core.events import GroundTracked, Initializing, MavTracked, TrackingLost
from airground.core.messages import GroundImage, MavImage, RobotCalibration
from airground.slam.front_end import TrackedCorners
from evaluation.run.onlooker import Seen
from evaluation.show.rerun_view.sensor_stream import (
    PATH_COLOUR,
    ROBOT,
    Level,
    Pace,
    SensorStream,
    camera_frame,
    image_frame,
)

FRUSTUM_M = 0.35
MAPPED, UNMAPPED = (90, 220, 120), (250, 190, 60)
"""Corners that are in the map, and those that wait for it."""
CORNER_RADIUS = rr.Radius.ui_points(1.8)
IMAGE_EVENTS = (MavTracked, GroundTracked, Initializing, TrackingLost)
"""Each image gives exactly one of these."""


class Images:
    """Both image streams.

    Args:
        stream: To draw on.
        level: How often, how large.
        calibrations: Of the robots.
    """

    def __init__(
        self, stream: SensorStream, level: Level, calibrations: Mapping[Source, RobotCalibration]
    ) -> None:
        self._stream, self._level = stream, level
        self._pace = {robot: Pace(level.image_hz) for robot in Source}
        for robot, calibration in calibrations.items():
            name = ROBOT[robot]
            image, corners = f"{name}/camera/image", f"{name}/camera/image/corners"
            stream.put_in_frame(image_frame(name), image, corners)
            lens = pinhole(
                calibration.camera,
                level.image_scale,
                (camera_frame(name), image_frame(name)),
                PATH_COLOUR[robot],
            )
            stream.log_always(image, lens)

    def see(self, seen: Seen) -> None:
        """Draw an image, whatever became of it."""
        frame = seen.frame
        if isinstance(seen.event, IMAGE_EVENTS) and self._pace[frame.robot].due(frame.stamp_ns):
            entity = f"{ROBOT[frame.robot]}/camera/image"
            self._stream.log(frame.stamp_ns, entity, self._encoded(frame.image))
            corners = _drawn(frame.pose.corners, self._level.image_scale)
            self._stream.log(frame.stamp_ns, f"{entity}/corners", corners)

    def _encoded(self, image: MavImage | GroundImage) -> rr.EncodedImage:
        pixels = (
            cv2.cvtColor(image.colour, cv2.COLOR_RGB2BGR)
            if isinstance(image, GroundImage)
            else image.image
        )
        if self._level.image_scale < 1:
            size = scaled_size(pixels.shape[1], pixels.shape[0], self._level.image_scale)
            pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
        _, jpeg = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, self._level.jpeg_quality])
        return rr.EncodedImage(contents=jpeg.tobytes(), media_type="image/jpeg")


def pinhole(
    camera: PinholeCamera, scale: float, frames: tuple[str, str], colour: tuple[int, int, int]
) -> rr.Pinhole:
    """A camera for images of another size; rerun counts pixels from the image's corner.

    Args:
        camera: Of the full image.
        scale: Size of what is drawn, as a share of it.
        frames: Those of the camera and of its image.
        colour: Of the frustum.
    """
    return rr.Pinhole(
        focal_length=(scale * camera.fx, scale * camera.fy),
        principal_point=(scale * (camera.cx + 0.5), scale * (camera.cy + 0.5)),
        resolution=scaled_size(camera.width, camera.height, scale),
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=FRUSTUM_M,
        parent_frame=frames[0],
        child_frame=frames[1],
        color=colour,
    )


def scaled_size(width: int, height: int, scale: float) -> tuple[int, int]:
    """Width and height [px]."""
    return round(scale * width), round(scale * height)


def _drawn(corners: TrackedCorners | None, scale: float) -> rr.Points2D:
    """Corners on an image; none at all take those of the image before away."""
    if corners is None:
        return rr.Points2D(np.empty((0, 2), np.float32))
    colours: NDArray = np.where(corners.mapped[:, None], MAPPED, UNMAPPED).astype(np.uint8)
    return rr.Points2D(
        scale * (corners.pixels + np.float32(0.5)), colors=colours, radii=CORNER_RADIUS
    )
