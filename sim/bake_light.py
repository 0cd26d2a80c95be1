"""Light that is worked out once: soft shadows and bounced light on a world that stands still.

A shadow map is sharp, jagged and drawn anew for every frame. Here rays to an extended lamp and
to the whole hemisphere give the irradiance at surface points; pictures carry it from then on,
so that a frame costs no lighting at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from sim.scene import Light
from sim.surface import Mesh

MAIN_SAMPLES = 24
FILL_SAMPLES = 10
AMBIENT_SAMPLES = 40
DISPLAY_GAMMA = 2.2
_FILL_RADIUS_DEG = 25.0
_LIFT_M = 0.002
_CHUNK = 20_000
_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
_MAIN_COLOUR = np.array([1.03, 1.0, 0.94])
_AMBIENT_COLOUR = np.array([0.95, 1.0, 1.07])
# Light that a surface seen by a hemisphere ray sends back, per unit of its albedo: about half
# of what open ground receives, for among boxes most surfaces lie in shade.
_BOUNCE = 0.55


@dataclass(frozen=True)
class LightBaker:
    """Casts rays in a world whose every triangle has a mean colour.

    Attributes:
        light: Lamps and ambient light.
        caster: Holds the triangles.
        albedo: (T, 3) mean linear reflectance of the triangles.
    """

    light: Light
    caster: o3d.t.geometry.RaycastingScene
    albedo: NDArray[np.float32]

    @classmethod
    def of(cls, mesh: Mesh, albedo: NDArray, light: Light) -> LightBaker:
        caster = o3d.t.geometry.RaycastingScene(nthreads=2)
        vertices, triangles = mesh
        caster.add_triangles(vertices.astype(np.float32), triangles.astype(np.uint32))
        return cls(light, caster, np.asarray(albedo, np.float32))

    def shade(self, points: NDArray, normals: NDArray) -> NDArray[np.float32]:
        """(N, 3) factors for display values (gamma 2.2) of a surface lit by this light.

        Args:
            points: (N, 3) on the surface [m].
            normals: (N, 3) unit normals, outward.
        """
        pieces = [
            self._irradiance(points[k : k + _CHUNK], normals[k : k + _CHUNK])
            for k in range(0, len(points), _CHUNK)
        ]
        return np.concatenate(pieces) ** (1 / DISPLAY_GAMMA)

    def _irradiance(self, points: NDArray, normals: NDArray) -> NDArray[np.float32]:
        light = self.light
        origins = (points + _LIFT_M * normals).astype(np.float32)
        normals = normals.astype(np.float32)
        main = _cone(light.azimuth_deg, light.elevation_deg, light.radius_deg, MAIN_SAMPLES)
        total = light.main * self._lamp(origins, normals, main)[:, None] * _MAIN_COLOUR
        if light.fill > 0:
            fill = _cone(light.azimuth_deg + 150, 50.0, _FILL_RADIUS_DEG, FILL_SAMPLES)
            total = total + light.fill * self._lamp(origins, normals, fill)[:, None]
        return (total + self._ambient(origins, normals)).astype(np.float32)

    def _lamp(self, origins: NDArray, normals: NDArray, directions: NDArray) -> NDArray:
        """(N,) irradiance, 1 for open level ground."""
        cosine = np.maximum(normals @ directions.T, 0)
        lit = np.zeros_like(cosine)
        facing = np.flatnonzero(cosine.max(1) > 0)
        if len(facing):
            rays = np.empty((len(facing), len(directions), 6), np.float32)
            rays[..., :3] = origins[facing, None]
            rays[..., 3:] = directions
            lit[facing] = ~self.caster.test_occlusions(o3d.core.Tensor(rays)).numpy()
        return (cosine * lit).sum(1) / np.maximum(directions[:, 2], 0).sum()

    def _ambient(self, origins: NDArray, normals: NDArray) -> NDArray:
        """(N, 3): open hemisphere gives the ambient level, what it hits bounces some light."""
        directions = _hemisphere(normals, AMBIENT_SAMPLES)
        rays = np.empty((*directions.shape[:2], 6), np.float32)
        rays[..., :3] = origins[:, None]
        rays[..., 3:] = directions
        hit = self.caster.cast_rays(o3d.core.Tensor(rays))["primitive_ids"].numpy()
        missed = hit == o3d.t.geometry.RaycastingScene.INVALID_ID
        level = self.light.main + self.light.ambient
        bounced = self.albedo[np.where(missed, 0, hit)] * (_BOUNCE * level)
        sky = self.light.ambient * _AMBIENT_COLOUR
        return np.where(missed[..., None], sky, bounced).mean(1)


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


def _hemisphere(normals: NDArray, count: int) -> NDArray:
    """(N, count, 3) cosine-weighted directions, the pattern turned from point to point."""
    index = np.arange(count)
    radius = np.sqrt((index + 0.5) / count)
    turn = (np.arange(len(normals)) * 0.7548776662466927 % 1.0) * 2 * np.pi
    angle = index[None] * _GOLDEN_ANGLE + turn[:, None]
    helper = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0, 0]], [[0, 1.0, 0]])
    across = np.cross(normals, helper)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    up = np.cross(normals, across)
    return (
        (radius * np.cos(angle))[..., None] * across[:, None]
        + (radius * np.sin(angle))[..., None] * up[:, None]
        + np.sqrt(1 - radius**2)[None, :, None] * normals[:, None]
    ).astype(np.float32)
