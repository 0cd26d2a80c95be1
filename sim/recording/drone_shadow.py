"""The MAV's shadow, added to a picture pixel by pixel: the world's light is baked without it.

A ray from each seen place to the middle of the main light passes the MAV's disc or it does not; the
lamp's radius makes the rim soft.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.appearance.bake_light import DISPLAY_GAMMA
from sim.scene import Light

DISC_M = 0.2
"""Radius of the level disc that stands for frame and rotors [m]."""


@dataclass(frozen=True)
class DroneShadow:
    """The shadow in one light.

    Attributes:
        light: Light on the world that is seen.
    """

    light: Light

    def cast(
        self,
        picture: NDArray[np.uint8],
        depth: NDArray[np.float32],
        camera: PinholeCamera,
        T_world_camera: SE3,
        mav_world: NDArray[np.float64],
    ) -> NDArray[np.uint8]:
        """The picture with the shadow in it.

        What lies in shade already gets darker too: the picture does not hold how much of the main
        light reaches a place.

        Args:
            picture: (height, width, channels) picture.
            depth: (height, width) depth at the pixels' centres [m], NaN where there is nothing.
            camera: Intrinsics of the camera.
            T_world_camera: Pose of the camera.
            mav_world: (3,) place of the MAV [m].
        """
        light = self.light
        total = light.main + light.fill + light.ambient
        if total <= 0:
            return picture
        lamp, near = np.array(_direction(light)), light.lamp_m is not None
        if light.lamp_m is not None:
            lamp = np.array(light.lamp_m)
        out = picture.copy()
        _darken(
            out,
            depth,
            np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
            np.column_stack([T_world_camera.rotation, T_world_camera.translation]),
            mav_world,
            lamp,
            near,
            np.tan(np.radians(light.radius_deg)),
            light.main / total,
        )
        return out


def _direction(light: Light) -> tuple[float, float, float]:
    """Unit vector toward a light that is far away."""
    azimuth, elevation = np.radians(light.azimuth_deg), np.radians(light.elevation_deg)
    flat = float(np.cos(elevation))
    return flat * float(np.cos(azimuth)), flat * float(np.sin(azimuth)), float(np.sin(elevation))


@njit(cache=True, error_model="numpy")
def _darken(picture, depth, intrinsics, T, mav, lamp, near, spread, share):  # type: ignore[no-untyped-def]
    """`lamp` is a place if it is `near`, else a direction; its radius has the tangent `spread`."""
    fx, fy, cx, cy = intrinsics
    height, width, channels = picture.shape
    for row in range(height):
        for column in range(width):
            z = depth[row, column]
            if not np.isfinite(z):
                continue
            x, y = (column - cx) / fx * z, (row - cy) / fy * z
            px = T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]
            py = T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]
            pz = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
            lx, ly, lz = lamp[0], lamp[1], lamp[2]
            if near:
                lx, ly, lz = lx - px, ly - py, lz - pz
            rise = mav[2] - pz
            if rise <= 0.02 or lz <= 0 or (near and rise >= lz):
                continue
            step = rise / lz
            off = np.hypot(px + step * lx - mav[0], py + step * ly - mav[1])
            # Half width of the light's cone where the ray passes the disc.
            soft = max(step * np.sqrt(lx * lx + ly * ly + lz * lz) * spread, 0.005)
            cover = _hidden(off, soft)
            if cover <= 0:
                continue
            factor = (1 - cover * share) ** (1 / DISPLAY_GAMMA)
            for channel in range(channels):
                picture[row, column, channel] = np.uint8(
                    picture[row, column, channel] * factor + 0.5
                )


@njit(cache=True, error_model="numpy")
def _hidden(off, soft):  # type: ignore[no-untyped-def]
    """Share of the light's disc of radius `soft` behind the MAV's, their centres `off` apart [m]:
    whole, none, and a smooth step between."""
    most = min(1.0, (DISC_M / soft) ** 2)
    inner, outer = abs(DISC_M - soft), DISC_M + soft
    if off >= outer:
        return 0.0
    if off <= inner:
        return most
    t = (outer - off) / (outer - inner)
    return most * t * t * (3 - 2 * t)
