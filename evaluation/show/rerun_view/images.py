"""Images of both cameras with the tracked corners, and the MAV's depth maps (Fig. 6)."""

from __future__ import annotations

import io
from collections.abc import Mapping

import cv2
import numpy as np
import rerun as rr
from matplotlib.colors import Colormap, to_rgb
from numpy.typing import NDArray
from PIL import Image

from airground.core.camera import PinholeCamera
from airground.core.cloud import Source
from airground.core.events import (
    DepthMapMade,
    GroundTracked,
    Initializing,
    MavTracked,
    TrackingLost,
)
from airground.core.messages import GroundImage, MavImage, RobotCalibration
from airground.slam.front_end import TrackedCorners
from evaluation.run.onlooker import Seen
from evaluation.show.figures.style import ERROR_COLOURS, colour_map, value_range
from evaluation.show.rerun_view.sensor_stream import (
    PATH_COLOUR,
    ROBOT,
    TRUTH,
    Level,
    Pace,
    SensorStream,
    camera_frame,
    image_frame,
)
from evaluation.table.truth_errors import depth_error
from sim.recording.truth import Truth

FRUSTUM_M = 0.35
MAPPED, UNMAPPED = (90, 220, 120), (250, 190, 60)
"""Colours of corners that are in the map, and of those that are not yet."""
CORNER_RADIUS = rr.Radius.ui_points(1.8)
IMAGE_EVENTS = (MavTracked, GroundTracked, Initializing, TrackingLost)
"""Each image gives exactly one of these."""
STEP_M = 1e-3
"""Resolution of depth [m]: 16 bits then hold 65 m."""
LEAST_RANGE_M = 0.1
ERROR_LIMIT_M = 0.03
"""Depth error at the ends of its colour scale [m]: blue is too near, red too far."""
HOLE = "#2B2E33"
"""Colour of pixels without a number, for the viewer's dark background."""
SHADES = 255
"""Colours of a picture; one more is for holes."""


class Images:
    """Both image streams, with the frustums of their cameras."""

    def __init__(
        self, stream: SensorStream, level: Level, calibrations: Mapping[Source, RobotCalibration]
    ) -> None:
        self._stream, self._level = stream, level
        self._pace = {robot: Pace(level.image_hz) for robot in Source}
        for robot, calibration in calibrations.items():
            name = ROBOT[robot]
            image, corners = f"{name}/camera/image", f"{name}/camera/image/corners"
            stream.put_in_frame(image_frame(name), image, corners)
            frames = camera_frame(name), image_frame(name)
            lens = pinhole(calibration.camera, level.image_scale, frames, PATH_COLOUR[robot])
            stream.log_always(image, lens)

    def see(self, seen: Seen) -> None:
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
            size = _scaled_size(pixels.shape[1], pixels.shape[0], self._level.image_scale)
            pixels = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
        _, jpeg = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, self._level.jpeg_quality])
        return rr.EncodedImage(contents=jpeg.tobytes(), media_type="image/jpeg")


def pinhole(
    camera: PinholeCamera, scale: float, frames: tuple[str, str], colour: tuple[int, int, int]
) -> rr.Pinhole:
    """A camera for images of another size; rerun counts pixels from the image's corner.
    `scale` is a share of the full size; `frames` are those of the camera and of its image."""
    return rr.Pinhole(
        focal_length=(scale * camera.fx, scale * camera.fy),
        principal_point=(scale * (camera.cx + 0.5), scale * (camera.cy + 0.5)),
        resolution=_scaled_size(camera.width, camera.height, scale),
        camera_xyz=rr.ViewCoordinates.RDF,
        image_plane_distance=FRUSTUM_M,
        parent_frame=frames[0],
        child_frame=frames[1],
        color=colour,
    )


def _scaled_size(width: int, height: int, scale: float) -> tuple[int, int]:
    return round(scale * width), round(scale * height)


def _drawn(corners: TrackedCorners | None, scale: float) -> rr.Points2D:
    """Corners on an image; an empty set removes those of the image before."""
    if corners is None:
        return rr.Points2D(np.empty((0, 2), np.float32))
    colours: NDArray = np.where(corners.mapped[:, None], MAPPED, UNMAPPED).astype(np.uint8)
    return rr.Points2D(
        scale * (corners.pixels + np.float32(0.5)), colors=colours, radii=CORNER_RADIUS
    )


class DepthMaps:
    """Depth maps; with truth also their errors."""

    def __init__(self, stream: SensorStream, level: Level, truth: Truth | None) -> None:
        self._stream, self._truth = stream, truth
        self._pace = Pace(level.depth_map_hz)

    def see(self, seen: Seen) -> None:
        match seen.event:
            case DepthMapMade(stamp_ns=stamp_ns, depth_map=made) if self._pace.due(stamp_ns):
                self._stream.log(stamp_ns, "mav/depth_map", _encoded_depth(made.depth))
                if self._truth is not None:
                    error = depth_error(made.depth, made.camera, made.stamp_ns, self._truth)
                    picture = coloured(error, ERROR_COLOURS, -ERROR_LIMIT_M, ERROR_LIMIT_M)
                    self._stream.log(stamp_ns, f"{TRUTH}/depth_error", picture)


def _encoded_depth(depth: NDArray[np.float32]) -> rr.EncodedDepthImage:
    """Depth [m] as a PNG of 16 bits; NaN becomes 0."""
    steps = np.rint(np.nan_to_num(depth, nan=0.0) / STEP_M).clip(0, np.iinfo(np.uint16).max)
    _, png = cv2.imencode(".png", steps.astype(np.uint16))
    near, far = value_range(depth, 1, 99)
    # Nothing but holes has the darkest colour.
    limits = (near - max(far - near, LEAST_RANGE_M) / 3, far)
    return rr.EncodedDepthImage(
        blob=png.tobytes(),
        media_type="image/png",
        meter=1 / STEP_M,
        colormap=rr.components.Colormap.Viridis,
        depth_range=np.asarray(limits) / STEP_M,
    )


def coloured(values: NDArray, colours: str | Colormap, low: float, high: float) -> rr.EncodedImage:
    """A picture (rows, columns) of numbers, NaN for holes; numbers beyond a limit are clipped."""
    picture = Image.fromarray(shade_index(values, low, high), mode="P")
    shades = colour_map(colours)(np.linspace(0, 1, SHADES))[:, :3]
    palette = np.rint(255 * np.vstack([shades, to_rgb(HOLE)])).astype(np.uint8)
    picture.putpalette(palette.tobytes())
    packed = io.BytesIO()
    picture.save(packed, "PNG", compress_level=6)
    return rr.EncodedImage(contents=packed.getvalue(), media_type="image/png")


def shade_index(values: NDArray, low: float, high: float) -> NDArray[np.uint8]:
    """Index of each number's colour; `SHADES` for NaN."""
    share = np.clip((values - low) / max(high - low, 1e-9), 0, 1)
    index = np.where(np.isnan(share), SHADES, np.rint((SHADES - 1) * np.nan_to_num(share)))
    return index.astype(np.uint8)
