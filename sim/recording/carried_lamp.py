"""Light of a lamp that a robot carries at its camera, added to a picture pixel by pixel.

The lamp is where the camera is, so the camera sees none of the shadows that it throws.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.appearance.bake_light import DISPLAY_GAMMA

_LINEAR = (np.arange(256) / 255.0) ** DISPLAY_GAMMA
"""Light of a display value, as a share of that of white."""
_STEPS = 4095
_DISPLAY = np.rint(255 * (np.arange(_STEPS + 1) / _STEPS) ** (2 / DISPLAY_GAMMA)).astype(np.uint8)
"""Display value of a light by its root in steps: finer than a display value everywhere."""


@dataclass(frozen=True)
class CarriedLamp:
    """A spot light along the camera's axis.

    Attributes:
        irradiance: Irradiance of a surface that faces it at 1 m, in units of the scene's light.
        beam_deg: Angle from the axis at which it shines half as bright [deg].
    """

    irradiance: float
    beam_deg: float

    def lit(
        self,
        picture: NDArray[np.uint8],
        unlit: NDArray[np.uint8],
        depth: NDArray[np.float32],
        rays: NDArray[np.float64],
    ) -> NDArray[np.uint8]:
        """The picture with the lamp's light on it.

        Args:
            picture: (height, width, 3) picture in the light of the scene.
            unlit: (height, width, 3) the same surfaces without light.
            depth: (height, width) depth [m], NaN where there is nothing.
            rays: (height, width, 3) rays of the pixels with z = 1, in the camera.
        """
        out = np.empty_like(picture)
        points = (rays * depth[..., None]).astype(np.float32)
        beam = np.radians(self.beam_deg)
        _add(picture, unlit, points, self.irradiance, beam, _LINEAR, _DISPLAY, out)
        return out


@njit(cache=True, error_model="numpy")
def _add(picture, unlit, points, irradiance, beam, linear, display, out):  # type: ignore[no-untyped-def]
    height, width, channels = picture.shape
    for row in range(height):
        for column in range(width):
            x, y, z = points[row, column]
            light = 0.0
            if np.isfinite(z):
                squared = x * x + y * y + z * z
                distance = np.sqrt(squared)
                off_axis = np.arccos(min(z / distance, 1.0)) / beam
                facing = _plane_distance(points, row, column) / distance
                light = irradiance * facing * 0.5 ** (off_axis * off_axis) / squared
            for channel in range(channels):
                shown = picture[row, column, channel]
                if light > 0:
                    total = linear[shown] + light * linear[unlit[row, column, channel]]
                    shown = display[int(min(np.sqrt(total), 1.0) * _STEPS + 0.5)]
                out[row, column, channel] = shown


@njit(cache=True, error_model="numpy")
def _plane_distance(points, row, column):  # type: ignore[no-untyped-def]
    """Distance of the camera from the plane of the surface at a pixel [m]; 0 if it is unknown."""
    ax, ay, az = _difference(points[row], column)
    bx, by, bz = _difference(points[:, column], row)
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    x, y, z = points[row, column]
    return abs(nx * x + ny * y + nz * z) / length if length > 0 else 0.0


@njit(cache=True, error_model="numpy")
def _difference(line, at):  # type: ignore[no-untyped-def]
    """Step to the neighbour that is nearer in depth, which is on the same surface; 0 if there is
    none."""
    best, first = np.inf, -1
    for one in (at, at - 1):
        if 0 <= one < len(line) - 1:
            step = abs(line[one + 1, 2] - line[one, 2])
            if step < best:  # false for NaN
                best, first = step, one
    if first < 0:
        return 0.0, 0.0, 0.0
    a, b = line[first], line[first + 1]
    return float(b[0] - a[0]), float(b[1] - a[1]), float(b[2] - a[2])
