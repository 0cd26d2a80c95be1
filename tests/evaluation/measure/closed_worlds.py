"""Worlds in closed form: boxes on a floor, seen by both robots without any error."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.config import Config
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import AerialSurface
from evaluation.measure.baselines.interface import Given

T_GROUND_MAV = SE3.from_heading(0.6, (0.35, -0.25, 0.4))
"""The truth of every world here."""

BOXES = (
    ((0.45, 0.35), (0.5, 0.3, 0.4), 0.3),
    ((-0.55, 0.1), (0.3, 0.6, 0.7), -0.4),
    ((0.2, -0.6), (0.35, 0.25, 0.25), 1.0),
)
"""Middle (x, y) in `ground`, size and turn of each."""

CAMERA = PinholeCamera(64, 48, 50.0, 50.0, 31.5, 23.5)
LOOKING_DOWN = np.diag([1.0, -1.0, -1.0])


def boxes_on_floor(step_m: float = 0.025) -> NDArray[np.float64]:
    """(N, 3) points of a floor and of the boxes' tops and sides, in `ground` [m]."""
    points = [_floor(2.5, step_m)]
    for (x, y), size, turn in BOXES:
        length, width, height = size
        u, v = np.meshgrid(_steps(length, step_m), _steps(width, step_m), indexing="ij")
        top = np.column_stack([u.ravel(), v.ravel(), np.full(u.size, height)])
        levels = np.arange(step_m, height, step_m)
        outline = [(a, s * width / 2) for a in _steps(length, step_m) for s in (-1, 1)]
        outline += [(s * length / 2, a) for a in _steps(width, step_m) for s in (-1, 1)]
        sides = np.array([(a, b, z) for a, b in outline for z in levels])
        points.append(SE3.from_heading(turn, (x, y, 0.0)) @ np.vstack([top, sides]))
    return np.vstack(points)


def bare_floor(step_m: float = 0.025) -> NDArray[np.float64]:
    return _floor(2.5, step_m)


def given_of(points_ground: NDArray, prior: SE3 | None = None, seed: int = 0) -> Given:
    """Both robots see the same points, the MAV those within 1 m of what is below it."""
    camera = SE3(LOOKING_DOWN, np.array([0.0, 0.0, 2.0]))
    T_mav_camera = T_GROUND_MAV.inverse() @ camera
    near = np.abs(points_ground[:, :2] - camera.translation[:2]).max(axis=1) < 1.0
    points_mav = T_GROUND_MAV.inverse() @ points_ground[near]
    depth = np.full((CAMERA.height, CAMERA.width), np.nan, np.float32)
    surface = AerialSurface(1, 1, CAMERA, T_mav_camera, depth, _cloud(points_mav), 5)
    T_ground_camera = SE3(LOOKING_DOWN, np.array([0.4, 0.3, 0.5]))
    heading = T_GROUND_MAV.heading()
    sighting = Sighting(
        surface, _cloud(points_ground), 1, T_mav_camera, 1, T_ground_camera, heading
    )
    return Given(sighting, Config(), np.random.default_rng(seed), prior)


def error_of(T_ground_mav: SE3, given: Given) -> tuple[float, float]:
    """Distance [m] and angle [deg] of the camera from the truth."""
    camera = given.sighting.T_mav_camera
    true, found = T_GROUND_MAV @ camera, T_ground_mav @ camera
    off = float(np.linalg.norm(found.translation - true.translation))
    return off, float(np.rad2deg((true.inverse() @ found).angle()))


def _floor(half_m: float, step_m: float) -> NDArray[np.float64]:
    x, y = np.meshgrid(*[np.arange(-half_m, half_m, step_m)] * 2, indexing="ij")
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])


def _steps(length: float, step_m: float) -> NDArray[np.float64]:
    return np.linspace(-length / 2, length / 2, round(length / step_m) + 1)


def _cloud(points: NDArray) -> PointCloud:
    return PointCloud(points.astype(np.float32), np.zeros((len(points), 3), np.uint8))
