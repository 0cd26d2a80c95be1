"""Shares of what images show that other images show, too."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.io.robot_recording import Pair
from sim.recording.truth import Truth
from sim.robots.motion import Robot

HALVINGS = 3
"""Cameras whose pixels are projected are halved so often: 94 x 60 pixels give a share within some
percent."""
VIEWS: dict[Robot, int] = {"mav": 12, "ground": 60}
"""Images whose surface is compared, spread evenly over the recording."""
CELL_M = 0.1
"""Points of two robots in one cell, or in cells side by side, are of one place [m]."""
GROUND_REACH_M = 5.0
"""Depth up to which the ground robot counts as having seen a place: the reach of a Kinect [m]."""
_HALF, _BITS = 1 << 19, 20
"""Cells per axis that fit into one int64 with two others."""


def small(camera: PinholeCamera) -> PinholeCamera:
    """The camera with an eighth of the pixels in each direction."""
    for _ in range(HALVINGS):
        camera = camera.halved()
    return camera


def points_camera(camera: PinholeCamera, depth: NDArray[np.float32]) -> NDArray[np.float64]:
    """(N, 3) points [m] of a depth image (height, width) [m], where it is known."""
    points = camera.back_project(depth.astype(np.float64)).reshape(-1, 3)
    return np.asarray(points[np.isfinite(points).all(axis=1)], np.float64)


def share_inside(
    points_world: NDArray[np.float64], camera: PinholeCamera, T_world_camera: SE3
) -> float:
    """Share of points (N, 3) that project into an image, hidden or not; NaN without points."""
    if not len(points_world):
        return float("nan")
    pixels = camera.project(T_world_camera.inverse() @ points_world)
    inside = (pixels >= -0.5) & (pixels <= [camera.width - 0.5, camera.height - 0.5])
    return float(inside.all(axis=1).mean())


def shared_with_ground(recording: Pair, truth: Truth) -> NDArray[np.float64]:
    """(K,) share of the surface in each of some MAV images that the ground robot has seen before
    or after, by the true surfaces and poses."""
    seen = {robot: _seen(recording, truth, robot) for robot in VIEWS}
    return shares(seen["mav"], np.concatenate(seen["ground"]))


def shares(
    views_world: list[NDArray[np.float64]], other_world: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(K,) for each of K views, the share of its points (N, 3) that lie in a cell with one of the
    others (M, 3), or in a cell beside one [m]."""
    cells = np.unique(_cells(other_world), axis=0)
    beside = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3), axis=-1).reshape(-1, 1, 3)
    near = np.unique(_packed((cells + beside).reshape(-1, 3)))
    return np.array([np.isin(_packed(_cells(view)), near).mean() for view in views_world])


def _seen(recording: Pair, truth: Truth, robot: Robot) -> list[NDArray[np.float64]]:
    """Points of the true surface in some images of a robot, without images that show nothing."""
    sensed = recording.mav if robot == "mav" else recording.ground
    camera, reach_m = small(sensed.calibration.camera), np.inf
    if robot == "ground":
        reach_m = GROUND_REACH_M
    stamps = sensed.camera_stamps
    found = []
    for index in np.unique(np.linspace(0, len(stamps) - 1, VIEWS[robot]).astype(int)):
        pose = truth.T_world_camera(robot, int(stamps[index]))
        depth = truth.surface(robot).cast(camera, pose)
        points = points_camera(camera, np.where(depth <= reach_m, depth, np.float32(np.nan)))
        if len(points):
            found.append(pose @ points)
    return found or [np.zeros((0, 3))]


def _cells(points_world: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.floor(points_world / CELL_M).astype(np.int64)


def _packed(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """(N,) one number for each cell (N, 3)."""
    x, y, z = (cells + _HALF).T
    return (x << 2 * _BITS) | (y << _BITS) | z
