"""Soft shadows and bounced light of a static world, worked out once.

Rays to an extended lamp and to the whole hemisphere give the irradiance at surface points.
Pictures carry it from then on, so that a frame costs no lighting.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.geometry.surface import Mesh, RayCaster
from sim.scene import Light

MAIN_SAMPLES = 24
FILL_SAMPLES = 10
AMBIENT_SAMPLES = 32
DISPLAY_GAMMA = 2.2
_FILL_RADIUS_DEG = 25.0
_LIFT_M = 0.002
_CHUNK = 20_000
_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
# Light that a surface seen by a hemisphere ray sends back, per unit of its albedo: about half
# of what open ground receives, for among boxes most surfaces lie in shade.
_BOUNCE = 0.55


@dataclass(frozen=True)
class LightBaker:
    """Casts rays in a world; `albedo` is (T, 3) mean linear reflectance of its triangles.
    Without a light it leaves pictures as they are painted."""

    light: Light | None
    caster: RayCaster
    albedo: NDArray[np.float32]

    @classmethod
    def of(cls, mesh: Mesh, albedo: NDArray, light: Light | None) -> LightBaker:
        return cls(light, RayCaster(mesh), np.asarray(albedo, np.float32))

    def shade(self, points: NDArray, normals: NDArray) -> NDArray[np.float32]:
        """(N, 3) factors for display values (gamma 2.2) of a surface lit by this light.

        `points` (N, 3) are on the surface [m], `normals` (N, 3) are outward unit vectors.
        """
        if self.light is None:
            return np.ones((len(points), 3), np.float32)
        pieces = [
            self._irradiance(self.light, points[k : k + _CHUNK], normals[k : k + _CHUNK])
            for k in range(0, len(points), _CHUNK)
        ]
        return np.concatenate(pieces) ** (1 / DISPLAY_GAMMA)

    def _irradiance(self, light: Light, points: NDArray, normals: NDArray) -> NDArray[np.float32]:
        origins = (points + _LIFT_M * normals).astype(np.float32)
        normals = normals.astype(np.float32)
        total = (
            light.main * self._main(light, origins, normals)[:, None] * np.array(light.main_colour)
        )
        if light.fill > 0:
            fill = _cone(light.azimuth_deg + 150, 50.0, _FILL_RADIUS_DEG, FILL_SAMPLES)
            total = total + light.fill * self._far_lamp(origins, normals, fill)[:, None]
        return (total + self._ambient(light, origins, normals)).astype(np.float32)

    def _main(self, light: Light, origins: NDArray, normals: NDArray) -> NDArray:
        if light.lamp_m is not None:
            return self._near_lamp(origins, normals, np.array(light.lamp_m), light.radius_deg)
        sun = _cone(light.azimuth_deg, light.elevation_deg, light.radius_deg, MAIN_SAMPLES)
        return self._far_lamp(origins, normals, sun)

    def _near_lamp(
        self, origins: NDArray, normals: NDArray, lamp: NDArray, radius_deg: float
    ) -> NDArray:
        """(N,) irradiance by a ball, 1 for level ground at height 0 below it."""
        ball = _cone(0.0, 90.0, radius_deg, MAIN_SAMPLES) * lamp[2]
        rays = np.empty((len(origins), MAIN_SAMPLES, 6), np.float32)
        rays[..., :3] = origins[:, None]
        # A disc that faces up, moved to the lamp.
        rays[..., 3:] = lamp + ball - [0, 0, lamp[2]] - origins[:, None]
        length = np.linalg.norm(rays[..., 3:], axis=2)
        cosine = np.maximum((rays[..., 3:] * normals[:, None]).sum(2) / length, 0)
        distance, _ = self.caster.hits(rays)
        return (cosine * (lamp[2] / length) ** 2 * (distance > 1)).mean(1)

    def _far_lamp(self, origins: NDArray, normals: NDArray, directions: NDArray) -> NDArray:
        """(N,) irradiance, 1 for open level ground."""
        cosine = np.maximum(normals @ directions.T, 0)
        lit = np.zeros_like(cosine)
        facing = np.flatnonzero(cosine.max(1) > 0)
        if len(facing):
            rays = np.empty((len(facing), len(directions), 6), np.float32)
            rays[..., :3] = origins[facing, None]
            rays[..., 3:] = directions
            lit[facing] = ~self.caster.blocked(rays)
        return (cosine * lit).sum(1) / np.maximum(directions[:, 2], 0).sum()

    def _ambient(self, light: Light, origins: NDArray, normals: NDArray) -> NDArray:
        """(N, 3): open hemisphere gives the ambient level, what it hits bounces some light."""
        rays = _hemisphere_rays(origins, normals, AMBIENT_SAMPLES)
        _, hit = self.caster.hits(rays)
        bounce = _BOUNCE * (light.main + light.ambient)
        sky = light.ambient * np.array(light.ambient_colour)
        return _gather(hit, self.albedo, bounce, sky)


def _cone(azimuth_deg: float, elevation_deg: float, radius_deg: float, count: int) -> NDArray:
    """(count, 3) unit directions spread evenly over a disc of the sky."""
    azimuth, elevation = np.radians(azimuth_deg), np.radians(elevation_deg)
    centre = np.array(
        [
            np.cos(azimuth) * np.cos(elevation),
            np.sin(azimuth) * np.cos(elevation),
            np.sin(elevation),
        ]
    )
    across = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.cross(centre, across)
    index = np.arange(count)
    radius = np.tan(np.radians(radius_deg)) * np.sqrt((index + 0.5) / count)
    angle = index * _GOLDEN_ANGLE
    spread = radius[:, None] * (np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * up)
    directions = centre + spread
    return (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)


@njit(cache=True, error_model="numpy")
def _hemisphere_rays(origins: NDArray, normals: NDArray, count: int) -> NDArray:
    """(N, count, 6) rays with cosine-weighted directions, the pattern turned at each point."""
    rays = np.empty((len(normals), count, 6), np.float32)
    for n in range(len(normals)):
        x, y, z = normals[n]
        # A frame around the normal without branches on its direction (Duff et al. 2017).
        sign = 1.0 if z >= 0 else -1.0
        a = -1.0 / (sign + z)
        b = x * y * a
        turn = (n * 0.7548776662466927) % 1.0 * 2 * np.pi
        for k in range(count):
            radius = np.sqrt((k + 0.5) / count)
            angle = turn + k * _GOLDEN_ANGLE
            u, v, w = radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius * radius)
            rays[n, k, 0], rays[n, k, 1], rays[n, k, 2] = origins[n]
            rays[n, k, 3] = u * (1 + sign * x * x * a) + v * b + w * x
            rays[n, k, 4] = u * sign * b + v * (sign + y * y * a) + w * y
            rays[n, k, 5] = -u * sign * x - v * y + w * z
    return rays


@njit(cache=True, error_model="numpy")
def _gather(hit: NDArray, albedo: NDArray, bounce: float, sky: NDArray) -> NDArray:
    """(N, 3) mean over rays: the sky where nothing is hit, else what the triangle sends back."""
    out = np.zeros((hit.shape[0], 3), np.float32)
    for n in range(hit.shape[0]):
        for k in range(hit.shape[1]):
            for c in range(3):
                missed = hit[n, k] >= len(albedo)
                out[n, c] += sky[c] if missed else bounce * albedo[hit[n, k], c]
        out[n] /= hit.shape[1]
    return out
