"""Closed-form worlds with procedural texture, seen by an ideal or a noisy camera.

The world's frame plays the part of `mav`. Open3D casts the rays; grey values are value
noise at the points that they hit, so that every view sees the same paint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numba import njit, prange
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3

CAMERA = PinholeCamera(752, 480, 420.0, 420.0, 375.5, 239.5)
SMALL_CAMERA = PinholeCamera(240, 160, 134.0, 134.0, 119.5, 79.5)
DOWN = np.array([[0.0, -1, 0], [-1, 0, 0], [0, 0, -1]])
"""Rotation of a camera that looks straight down, image top towards +x."""


@njit(cache=True)
def _hash(ix: int, iy: int, iz: int, seed: int) -> float:
    h = np.uint32(ix * 374761393 + iy * 668265263 + iz * 2147483647 + seed * 1274126177)
    h = np.uint32((h ^ (h >> np.uint32(13))) * np.uint32(1274126177))
    h = np.uint32((h ^ (h >> np.uint32(16))) * np.uint32(2246822519))
    return float(h ^ (h >> np.uint32(15))) / 4294967296.0


@njit(cache=True)
def _value_noise(x: float, y: float, z: float, seed: int) -> float:
    ix, iy, iz = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
    u, v, w = x - ix, y - iy, z - iz
    u, v, w = u * u * (3 - 2 * u), v * v * (3 - 2 * v), w * w * (3 - 2 * w)
    total = 0.0
    for dx in range(2):
        for dy in range(2):
            for dz in range(2):
                weight = (u if dx else 1 - u) * (v if dy else 1 - v) * (w if dz else 1 - w)
                total += weight * _hash(ix + dx, iy + dy, iz + dz, seed)
    return total - 0.5


@njit(cache=True, parallel=True)
def _paint(points: NDArray, surface: NDArray, base: NDArray, contrast: NDArray) -> NDArray:
    """(N,) grey values in [0, 255]: octaves of noise, and dark labels on some boxes."""
    grey = np.empty(len(points), np.float32)
    for i in prange(len(points)):
        s = surface[i]
        x, y, z = points[i]
        noise, wavelength, amplitude = 0.0, 0.2, 1.0
        for octave in range(5):
            noise += amplitude * _value_noise(
                x / wavelength, y / wavelength, z / wavelength, 17 * s + octave
            )
            wavelength *= 0.5
            amplitude *= 0.8
        value = base[s] + contrast[s] * noise
        if s > 0 and _value_noise(x / 0.11, y / 0.11, z / 0.11, 17 * s + 9) > 0.22:
            value -= 45.0
        grey[i] = min(max(value, 0.0), 255.0)
    return grey


@dataclass(frozen=True)
class World:
    """Triangles with paint; surface 0 is the floor.

    Attributes:
        vertices: (V, 3) float [m].
        triangles: (T, 3) int.
        surface: (T,) int, which object a triangle belongs to.
        base, contrast: (objects,) float, grey level and strength of the texture.
    """

    vertices: NDArray
    triangles: NDArray
    surface: NDArray
    base: NDArray
    contrast: NDArray

    def scene(self) -> o3d.t.geometry.RaycastingScene:
        scene = o3d.t.geometry.RaycastingScene()
        scene.add_triangles(
            o3d.core.Tensor(self.vertices.astype(np.float32)),
            o3d.core.Tensor(self.triangles.astype(np.uint32)),
        )
        return scene

    def depth(self, camera: PinholeCamera, T_mav_camera: SE3) -> NDArray[np.float32]:
        """(height, width) true depth [m], inf where nothing is hit."""
        return self._cast(camera, T_mav_camera)["t_hit"].numpy()

    def _cast(self, camera: PinholeCamera, pose: SE3) -> dict:
        directions = camera.rays() @ pose.rotation.T
        origins = np.broadcast_to(pose.translation, directions.shape)
        rays = np.concatenate([origins, directions], axis=2).astype(np.float32)
        return self.scene().cast_rays(o3d.core.Tensor(rays))

    def grey(
        self, camera: PinholeCamera, T_mav_camera: SE3, supersample: int = 2
    ) -> NDArray[np.float32]:
        """(height, width) noise-free image."""
        k = supersample
        fine = PinholeCamera(
            camera.width * k,
            camera.height * k,
            camera.fx * k,
            camera.fy * k,
            (camera.cx + 0.5) * k - 0.5,
            (camera.cy + 0.5) * k - 0.5,
        )
        hit = self._cast(fine, T_mav_camera)
        depth = hit["t_hit"].numpy()
        seen = np.isfinite(depth).ravel()
        points = (T_mav_camera @ (fine.rays() * depth[..., None]).reshape(-1, 3)[seen]).astype(
            np.float64
        )
        surface = self.surface[hit["primitive_ids"].numpy().ravel()[seen].astype(np.int64)]
        normals = hit["primitive_normals"].numpy().reshape(-1, 3)[seen]
        light = 0.8 + 0.2 * np.abs(normals @ np.array([0.35, 0.2, 0.9]))
        grey = np.zeros(seen.shape, np.float32)
        grey[seen] = light * _paint(points, surface, self.base, self.contrast)
        return grey.reshape(camera.height, k, camera.width, k).mean(axis=(1, 3))


def noisy(
    grey: NDArray, rng: np.random.Generator, sigma: float = 2.0, gain: float = 1.0
) -> NDArray[np.uint8]:
    """What a sensor makes of a noise-free image: gain, vignetting, noise, 8 bits."""
    height, width = grey.shape
    y, x = np.mgrid[:height, :width]
    radius2 = ((x - width / 2) ** 2 + (y - height / 2) ** 2) / (width / 2) ** 2
    image = grey * gain * (1 - 0.15 * radius2 * (sigma > 0)) + rng.normal(0, sigma, grey.shape)
    return np.clip(np.round(image), 0, 255).astype(np.uint8)


def plane_world(extent_m: float = 6.0) -> World:
    """A floor at z = 0."""
    e = extent_m
    vertices = np.array([[-e, -e, 0], [e, -e, 0], [e, e, 0], [-e, e, 0]], float)
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    return World(vertices, triangles, np.zeros(2, int), np.array([120.0]), np.array([70.0]))


def with_boxes(
    world: World, centres: NDArray, sizes: NDArray, rotations: NDArray, rng: np.random.Generator
) -> World:
    """Adds boxes: (B, 3) centres, (B, 3) full sizes, (B, 3, 3) rotations."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / 2
    faces = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    cube = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    vertices, triangles, surface = [world.vertices], [world.triangles], [world.surface]
    count = len(world.vertices)
    for i, (centre, size, rotation) in enumerate(zip(centres, sizes, rotations, strict=True)):
        vertices.append((corners * size) @ rotation.T + centre)
        triangles.append(cube + count)
        surface.append(np.full(len(cube), i + len(world.base)))
        count += 8
    n = len(centres)
    return World(
        np.concatenate(vertices),
        np.concatenate(triangles),
        np.concatenate(surface),
        np.concatenate([world.base, rng.uniform(110, 190, n)]),
        np.concatenate([world.contrast, rng.uniform(12, 45, n)]),
    )


def step_world(height_m: float = 0.3) -> World:
    """A floor, and a block that fills y > 0 up to `height_m`."""
    rng = np.random.default_rng(3)
    return with_boxes(
        plane_world(),
        np.array([[0.0, 2.0, height_m / 2]]),
        np.array([[8.0, 4.0, height_m]]),
        np.eye(3)[None],
        rng,
    )


def heap_world(seed: int = 0, boxes: int = 50) -> World:
    """A heap of tilted boxes up to about 0.8 m high over 4 x 4 m (they may intersect)."""
    rng = np.random.default_rng(seed)
    sizes = rng.uniform(0.18, 0.5, (boxes, 3))
    centres = rng.uniform([-1.5, -1.6, 0.08], [3.0, 1.6, 0.5], (boxes, 3))
    turns = Rotation.from_euler("z", rng.uniform(0, 360, (boxes, 1)), degrees=True)
    tilts = Rotation.from_rotvec(rng.normal(0, 0.18, (boxes, 3)))
    return with_boxes(plane_world(), centres, sizes, (tilts * turns).as_matrix(), rng)


def flight(
    frames: int, step_m: float = 1 / 60, height_m: float = 2.2, sway: float = 1.0
) -> list[SE3]:
    """Camera poses along +x at 0.5 m/s and 30 Hz with the small motions of a real flight."""
    poses = []
    for i in range(frames):
        t = i / 30
        position = (i * step_m, 0.03 * sway * np.sin(1.1 * t), height_m)
        position = np.array(position) + sway * 0.02 * np.array([0, 0, np.sin(1.7 * t + 1)])
        wobble = sway * np.array(
            [0.03 * np.sin(2.3 * t), 0.03 * np.sin(1.9 * t + 0.5), 0.02 * np.sin(0.9 * t)]
        )
        poses.append(SE3(Rotation.from_rotvec(wobble).as_matrix() @ DOWN, position))
    return poses
