"""Points before cameras, for the tests of geometry."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3

CAMERA = PinholeCamera(752, 480, 420.0, 420.0, 375.5, 239.5)
DOWN = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Camera axes in the map of a camera that looks down, its image up along x."""


def down_at(position: NDArray | list, turn: NDArray | list = (0, 0, 0)) -> SE3:
    """A camera that looks down from `position`, turned by a rotation vector in the map."""
    return SE3(SE3.from_rotation_vector(turn).rotation @ DOWN, np.asarray(position, float))


def seen_points(
    T_map_camera: SE3, n: int, depths: tuple[float, float], rng: np.random.Generator
) -> NDArray[np.float64]:
    """(n, 3) points in the map that fill the image, at depths in a range."""
    pixels = rng.uniform((10, 10), (CAMERA.width - 10, CAMERA.height - 10), (n, 2))
    rays = np.column_stack([pixels, np.ones(n)]) @ np.linalg.inv(CAMERA.matrix()).T
    return T_map_camera @ (rays * rng.uniform(*depths, (n, 1)))


def observe(T_map_camera: SE3, points_map: NDArray) -> NDArray[np.float64]:
    """(N, 2) pixels of points, without noise."""
    return CAMERA.project(T_map_camera.inverse() @ points_map)


def angle_between(a: NDArray, b: NDArray) -> float:
    """Angle of the rotation between two rotation matrices [rad]."""
    return SE3(a.T @ b, np.zeros(3)).angle()
