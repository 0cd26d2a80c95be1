"""A keyframe of the ground map, kept small, so that the map can be built again (Sec. IV)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from airground.core.messages import GroundImage
from airground.core.se3 import SE3

FINEST_STEP_M = 1e-4
"""Depth is kept in steps of this [m]: far below a sensor's noise, up to 6.5 m in 16 bits."""
LEVELS = np.iinfo(np.uint16).max
JPEG_QUALITY = 95
"""Some 90 kB an image of 640 x 480, where lossless compression takes 550."""


@dataclass(frozen=True, eq=False)
class GroundKeyframe:
    """What was seen from one pose; about 0.25 MB where the image is 640 x 480.

    Attributes:
        stamp_ns: Of the image.
        T_ground_camera: Where it was taken, as the map has it now.
        packed_depth: zlib of (height, width) uint16 multiples of `step_m`; 0 where missing.
        packed_colour: JPEG.
        step_m: Unit of the depth [m].
        shape: (height, width).
    """

    stamp_ns: int
    T_ground_camera: SE3
    packed_depth: bytes
    packed_colour: bytes
    step_m: float
    shape: tuple[int, int]

    @classmethod
    def pack(cls, image: GroundImage, T_ground_camera: SE3, max_depth_m: float) -> GroundKeyframe:
        """Keep an image; depth beyond `max_depth_m` and beside silhouettes is left out."""
        depth = image.depth
        with np.errstate(invalid="ignore"):
            usable = ~near_silhouette(depth) & (depth > 0) & (depth <= max_depth_m)
        step_m = max(FINEST_STEP_M, max_depth_m / LEVELS)
        levels = np.rint(np.where(usable, depth, 0.0) / step_m).astype(np.uint16)
        bgr = cv2.cvtColor(image.colour, cv2.COLOR_RGB2BGR)
        _, jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        return cls(
            image.stamp_ns,
            T_ground_camera,
            isal_zlib.compress(levels, 1),
            jpeg.tobytes(),
            step_m,
            (depth.shape[0], depth.shape[1]),
        )

    def depth(self) -> NDArray[np.float32]:
        """(height, width) [m], 0 where missing."""
        levels = np.frombuffer(isal_zlib.decompress(self.packed_depth), np.uint16)
        return levels.reshape(self.shape) * np.float32(self.step_m)

    def colour(self) -> NDArray[np.uint8]:
        """(height, width, 3) RGB."""
        bgr = cv2.imdecode(np.frombuffer(self.packed_colour, np.uint8), cv2.IMREAD_COLOR)
        assert bgr is not None
        return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB).astype(np.uint8)


def near_silhouette(depth: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels beside a jump in depth: there the sensor mixes fore- and background."""
    jump = np.zeros(depth.shape, bool)
    across = np.abs(np.diff(depth, axis=1)) > 0.05 * depth[:, 1:]
    down = np.abs(np.diff(depth, axis=0)) > 0.05 * depth[1:]
    jump[:, 1:] |= across
    jump[:, :-1] |= across
    jump[1:] |= down
    jump[:-1] |= down
    return jump
