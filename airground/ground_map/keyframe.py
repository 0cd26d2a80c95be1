"""A keyframe of the ground map, kept small, so that the map can be built again (Sec. IV)."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from isal import isal_zlib
from numba import njit

from airground.core.arrays import F32, U8, U16
from airground.core.messages import GroundImage
from airground.core.se3 import SE3

FINEST_STEP_M = 1e-4
"""Depth is kept in steps of this [m]: far below a sensor's noise, up to 6.5 m in 16 bits."""
LEVELS = np.iinfo(np.uint16).max
JUMP = np.float32(0.05)
"""Neighbours whose depths differ by more than this share are of different surfaces."""
JPEG_QUALITY = 95
"""JPEG quality: 90 kB per image of 640 x 480, where lossless compression takes 550 kB."""


@dataclass(frozen=True, eq=False)
class GroundKeyframe:
    """The images of one pose; about 0.25 MB at 640 x 480 pixels.

    Attributes:
        stamp_ns: Stamp of the image [ns].
        T_ground_camera: Newest estimate of the camera's pose.
        packed_depth: zlib of (height, width) uint16 multiples of `step_m`; 0 where missing.
        packed_colour: Colour image as JPEG.
        step_m: Unit of the depth [m].
        shape: Height and width of the images [px].
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
        step_m = max(FINEST_STEP_M, max_depth_m / LEVELS)
        levels = usable_levels(image.depth, np.float32(max_depth_m), np.float32(step_m))
        bgr = cv2.cvtColor(image.colour, cv2.COLOR_RGB2BGR)
        _, jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        return cls(
            image.stamp_ns,
            T_ground_camera,
            isal_zlib.compress(levels, 1),
            jpeg.tobytes(),
            step_m,
            levels.shape,
        )

    def unpack(self) -> tuple[F32, U8]:
        return self.depth(), self.colour()

    def depth(self) -> F32:
        """(height, width) [m], 0 where missing."""
        levels = np.frombuffer(isal_zlib.decompress(self.packed_depth), np.uint16)
        return levels.reshape(self.shape) * np.float32(self.step_m)

    def colour(self) -> U8:
        """(height, width, 3) RGB."""
        bgr = cv2.imdecode(np.frombuffer(self.packed_colour, np.uint8), cv2.IMREAD_COLOR)
        assert bgr is not None
        return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB).astype(np.uint8)


@njit(cache=True, nogil=True, error_model="numpy")
def usable_levels(depth: F32, max_depth_m: np.float32, step_m: np.float32) -> U16:
    """(height, width) depth [m] in steps of `step_m`, 0 where missing or beyond `max_depth_m`.
    Pixels on both sides of a jump in depth are left out: the sensor mixes fore- and background."""
    height, width = depth.shape
    levels = np.zeros(depth.shape, np.uint16)
    for y in range(height):
        above, below = max(y - 1, 0), min(y + 1, height - 1)
        for x in range(width):
            here = depth[y, x]
            if not (here > 0 and here <= max_depth_m):
                continue
            left, right = depth[y, max(x - 1, 0)], depth[y, min(x + 1, width - 1)]
            if (
                _jumps(left, here)
                or _jumps(here, right)
                or _jumps(depth[above, x], here)
                or _jumps(here, depth[below, x])
            ):
                continue
            levels[y, x] = np.uint16(np.rint(here / step_m))
    return levels


@njit(cache=True, nogil=True)
def _jumps(one: np.float32, next_one: np.float32) -> bool:
    """Whether depth jumps between neighbours; false where one is missing."""
    return bool(abs(next_one - one) > JUMP * next_one)
