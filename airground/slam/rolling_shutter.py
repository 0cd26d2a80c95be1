"""Pixels of a camera that takes its rows one after the other while it turns.

Within one image the camera is taken to turn evenly and not to move: in 26 ms a hand-held camera
turns by up to 5 deg, 45 px, but moves by millimetres (Ringaby and Forssen, "Scan rectification
for structured light range sensors with rolling shutters", ICCV 2011).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from airground.core.arrays import F32, F64, Floats
from airground.core.camera import PinholeCamera
from airground.slam import so3
from airground.slam.depth_lookup import inverse_depths_at

MIN_CORNERS = 15
"""Fewer corners show no turn that can be trusted."""
REFINEMENTS, OUTLIER = 4, 2.5
"""Fits of the turn, each to the corners that the one before left within so many times the median:
those of near things move by the hand's way, too."""
INVERSE_STEPS = 4
"""Fixed-point steps from a straight pixel to that in the image: each leaves a tenth of the error
at 3 rad/s."""


@dataclass(frozen=True, eq=False)
class Shutter:
    """How one image was taken.

    Attributes:
        camera: Intrinsics; None for a global shutter.
        turn_per_row: (3,) turn of the camera from one row to the next, in its own axes [rad].
    """

    camera: PinholeCamera | None = None
    turn_per_row: F64 = field(default_factory=lambda: np.zeros(3))

    def straight(self, pixels: Floats) -> F64:
        """(N, 2) where pixels would be, had all rows been taken with the middle one."""
        return self._turned(pixels, inverse=False)

    def in_image(self, pixels: Floats) -> F64:
        """(N, 2) where straight pixels are in the image."""
        return self._turned(pixels, inverse=True)

    def inverse_depths_at(self, depth: F32 | None, pixels: Floats, max_depth_m: float) -> F64:
        """(N,) `depth_lookup.inverse_depths_at` pixels of the image, along the optical axis of the
        middle row [1/m]: the axis turns with the rows."""
        inverse = inverse_depths_at(depth, pixels, max_depth_m)
        if self.camera is None:
            return inverse
        result: F64 = inverse * self.lengthened(pixels)
        return result

    def lengthened(self, pixels: Floats) -> F64:
        """(N,) inverse depth along the middle row's axis over that along the row's own: whatever
        way the axis points, the distance is the same."""
        assert self.camera is not None
        here, turned = _rays(self.camera, pixels), _rays(self.camera, self.straight(pixels))
        result: F64 = np.linalg.norm(turned, axis=1) / np.linalg.norm(here, axis=1)
        return result

    def _turned(self, pixels: Floats, inverse: bool) -> F64:
        asked: F64 = np.asarray(pixels, np.float64)
        camera = self.camera
        if camera is None:
            return asked
        k = np.array([camera.fx, camera.fy, camera.cx, camera.cy, (camera.height - 1) / 2])
        result: F64 = _turn_rows(np.ascontiguousarray(asked), k, self.turn_per_row, inverse)
        return result


GLOBAL = Shutter()
"""All rows at once."""


def shutter_of(
    camera: PinholeCamera, readout_s: float, before: Floats, here: Floats, seconds: float
) -> Shutter:
    """The shutter of an image by the corners that were followed into it.

    Between two images a corner moves by the turn between its two rows, whatever the times of the
    rows, if the turn is even. The turn of fitted poses does depend on the rows' times: straightened
    by it, images would pull the turns of the next ones to and fro.

    Args:
        readout_s: Time from the first to the last row [s].
        before, here: (N, 2) pixels of the corners in the image before and in this one.
        seconds: Time between the two [s].
    """
    if not readout_s or len(here) < MIN_CORNERS:
        return GLOBAL
    rays = [_unit(_rays(camera, pixels)) for pixels in (before, here)]
    chosen, turn = np.ones(len(here), bool), np.eye(3)
    for _ in range(REFINEMENTS):
        turn = _rotation(rays[1][chosen], rays[0][chosen])
        off = np.linalg.norm(rays[0] - rays[1] @ turn.T, axis=1)
        chosen = off <= OUTLIER * np.median(off)
    later = float(np.mean(np.asarray(here)[chosen, 1] - np.asarray(before)[chosen, 1]))
    between_s = seconds + later / camera.height * readout_s
    return Shutter(camera, so3.log(turn) * (readout_s / camera.height / between_s))


def _rays(camera: PinholeCamera, pixels: Floats) -> F64:
    """(N, 3) directions with z = 1."""
    rays: F64 = np.column_stack([pixels, np.ones(len(pixels))]) @ np.linalg.inv(camera.matrix()).T
    return rays


def _unit(vectors: F64) -> F64:
    result: F64 = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return result


def _rotation(a: F64, b: F64) -> F64:
    """(3, 3) rotation that brings (N, 3) vectors `a` onto `b` best (Kabsch)."""
    u, _, vt = np.linalg.svd(b.T @ a)
    rotation: F64 = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return rotation


@njit(cache=True, nogil=True, error_model="numpy")
def _turn_rows(pixels: F64, k: F64, turn_per_row: F64, inverse: bool) -> F64:
    out = np.empty_like(pixels)
    for i in range(len(pixels)):
        row = pixels[i, 1]
        for _ in range(INVERSE_STEPS if inverse else 1):
            R = so3.exp((row - k[4]) * turn_per_row)
            x, y = (pixels[i, 0] - k[2]) / k[0], (pixels[i, 1] - k[3]) / k[1]
            if inverse:
                R = R.T
            u = R[0, 0] * x + R[0, 1] * y + R[0, 2]
            v = R[1, 0] * x + R[1, 1] * y + R[1, 2]
            w = R[2, 0] * x + R[2, 1] * y + R[2, 2]
            out[i, 0], out[i, 1] = k[0] * u / w + k[2], k[1] * v / w + k[3]
            row = out[i, 1]
    return out
