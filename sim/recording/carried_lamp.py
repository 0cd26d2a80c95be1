"""Light of a lamp that a robot carries at its camera, added to a picture pixel by pixel.

The lamp is where the camera is, so the camera sees none of the shadows that it throws.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.appearance.bake_light import DISPLAY_GAMMA


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
        points = rays * depth[..., None].astype(np.float64)
        _add(picture, unlit, points, self.irradiance, np.radians(self.beam_deg), out)
        return out


@njit(cache=True, error_model="numpy")
def _add(picture, unlit, points, irradiance, beam, out):  # type: ignore[no-untyped-def]
    height, width, channels = picture.shape
    for row in range(height):
        for column in range(width):
            x, y, z = points[row, column]
            light = 0.0
            if np.isfinite(z):
                distance = np.sqrt(x * x + y * y + z * z)
                off_axis = np.arccos(z / distance) / beam
                facing = _facing(points, row, column) / distance
                light = irradiance * facing * 0.5 ** (off_axis * off_axis) / distance**2
            for channel in range(channels):
                value = float(picture[row, column, channel])
                albedo = float(unlit[row, column, channel])
                if light > 0 and albedo > 0:
                    own = (value / albedo) ** DISPLAY_GAMMA
                    value = albedo * (own + light) ** (1 / DISPLAY_GAMMA) + 0.5
                out[row, column, channel] = np.uint8(min(value, 255.0))


@njit(cache=True, error_model="numpy")
def _facing(points, row, column):  # type: ignore[no-untyped-def]
    """Distance of the camera from the plane of the surface at a pixel [m]."""
    along, down = np.empty(3), np.empty(3)
    if not (_difference(points[row], column, along) and _difference(points[:, column], row, down)):
        return 0.0
    nx = along[1] * down[2] - along[2] * down[1]
    ny = along[2] * down[0] - along[0] * down[2]
    nz = along[0] * down[1] - along[1] * down[0]
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    x, y, z = points[row, column]
    return abs(nx * x + ny * y + nz * z) / length if length > 0 else 0.0


@njit(cache=True, error_model="numpy")
def _difference(line, at, out):  # type: ignore[no-untyped-def]
    """Step to the neighbour that is nearer in depth, which is on the same surface; false if there
    is none."""
    best = np.inf
    for one, other in ((at, at + 1), (at - 1, at)):
        if one < 0 or other >= len(line):
            continue
        step = abs(line[other, 2] - line[one, 2])
        if step < best:  # false for NaN
            best = step
            for axis in range(3):
                out[axis] = line[other, axis] - line[one, axis]
    return best < np.inf
