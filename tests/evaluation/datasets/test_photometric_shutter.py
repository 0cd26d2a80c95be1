"""The fit of true poses to images of a rolling shutter, over a painted plane of known pixels."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from evaluation.datasets.inspection.photometric import Posed, fit
from sim.recording.row_poses import RowPoses

CAMERA = PinholeCamera(160, 120, 140.0, 140.0, 79.5, 59.5)
DISTANCE_M = 2.0
TURN_RAD = 0.04
"""Turn about the optical axis during the readout of the second image."""


def painted(x: NDArray, y: NDArray) -> NDArray:
    """Grey of the plane at places [m]: waves that repeat nowhere within the image."""
    waves = np.sin(9 * x + 3 * y) + np.sin(23 * x * y + 11 * y) + np.sin(17 * x - 5 * y * y)
    return 128 + 35 * waves


def taken(T_world_camera: SE3, shift_m: float, turn_rad: float) -> Posed:
    """An image down on the plane z = 0, while the camera moves along x, and turns, by so much from
    its first to its last row."""
    share = np.linspace(-0.5, 0.5, CAMERA.height)
    moved = [
        SE3.from_rotation_vector((0, 0, turn_rad * s), translation=(shift_m * s, 0, 0))
        for s in share
    ]
    rows = RowPoses(
        np.array([pose.rotation for pose in moved]), np.array([pose.translation for pose in moved])
    )
    world = rows.seen_from(T_world_camera.inverse())
    rays = CAMERA.rays() @ world.rotations.transpose(0, 2, 1)
    places = world.translations[:, None] + DISTANCE_M * rays
    grey = painted(places[..., 0], places[..., 1]).round().astype(np.uint8)
    return Posed(grey, np.full(grey.shape, DISTANCE_M, np.float32), T_world_camera, rows)


def down_from(x_m: float) -> SE3:
    """Pose of a camera that looks down, at the plane's distance."""
    return SE3(np.diag([1.0, -1.0, -1.0]), np.array([x_m, 0.0, DISTANCE_M]))


def test_poses_of_rows_fit_where_that_of_the_middle_row_does_not() -> None:
    first, second = taken(down_from(0.0), 0.02, 0.0), taken(down_from(0.25), 0.1, TURN_RAD)
    found = fit(first, second, CAMERA)
    assert found is not None
    assert np.abs(found.offset_px).max() < 0.05
    unaware = fit(
        Posed(first.grey, first.depth, first.T_world_camera),
        Posed(second.grey, second.depth, second.T_world_camera),
        CAMERA,
    )
    assert unaware is None or unaware.rise < 0.8 * found.rise


@pytest.mark.parametrize("off_px", [0.05, 0.3, 0.7, 1.4, 5.0])
def test_an_error_of_the_truth_is_measured(off_px: float) -> None:
    first, second = taken(down_from(0.0), 0.02, 0.0), taken(down_from(0.25), 0.1, TURN_RAD)
    turn = SE3.from_rotation_vector((0.0, -off_px / CAMERA.fx, 0.0))
    off = Posed(second.grey, second.depth, second.T_world_camera @ turn, second.rows)
    found = fit(first, off, CAMERA)
    assert found is not None
    assert np.linalg.norm(found.offset_px) == pytest.approx(off_px, abs=0.02)
