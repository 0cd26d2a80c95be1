"""Pixels of a camera that takes its rows one after the other while it turns.

Within one image the camera is taken to turn evenly and not to move: in 26 ms a hand-held camera
turns by up to 5 deg, 45 px, but moves by millimetres (Ringaby and Forssen, "Scan rectification
for structured light range sensors with rolling shutters", ICCV 2011).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from airground.core.arrays import F64, Floats
from airground.core.camera import PinholeCamera
from airground.slam import so3

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

    @classmethod
    def turning(cls, camera: PinholeCamera, readout_s: float, turn: F64, seconds: float) -> Shutter:
        """The shutter of an image before which the camera turned by (3, 3), from one image to the
        next in `seconds`."""
        if not readout_s:
            return GLOBAL
        rows_a_step = seconds / readout_s * camera.height
        return cls(camera, so3.log(np.ascontiguousarray(turn)) / rows_a_step)

    def straight(self, pixels: Floats) -> F64:
        """(N, 2) where pixels would be, had all rows been taken with the middle one."""
        return self._turned(pixels, inverse=False)

    def in_image(self, pixels: Floats) -> F64:
        """(N, 2) where straight pixels are in the image."""
        return self._turned(pixels, inverse=True)

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
