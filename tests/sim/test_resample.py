"""Places in a view, against the same equations pixel by pixel."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.core.camera import PinholeCamera
from sim.recording.resample import MAX_SLOPE, STEPS, places_in_view
from sim.recording.row_poses import RowPoses

CAMERA = PinholeCamera(60, 24, 50.0, 52.0, 29.0, 12.0)
HEIGHT, WIDTH = 12, 40


def slowly(
    rays: NDArray, rows: RowPoses, depth: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    places = np.empty((HEIGHT, WIDTH, 2), np.float32)
    found = np.empty((HEIGHT, WIDTH), np.float32)
    for row, column in np.ndindex(HEIGHT, WIDTH):
        ray, offset = rows.rotations[row] @ rays[row, column], rows.translations[row]
        u, v = pixel(ray)
        here = inverse_depth(depth, u, v)
        for _ in range(STEPS):
            point = ray * (1 - here * offset[2]) / (here * ray[2]) + offset if here else ray
            u, v = pixel(point)
            here = inverse_depth(depth, u, v)
        places[row, column] = u, v
        found[row, column] = (1 / here - offset[2]) / ray[2] if here else np.nan
    return places, found


def pixel(point: NDArray) -> tuple[float, float]:
    x, y, z = point
    return CAMERA.fx * x / z + CAMERA.cx, CAMERA.fy * y / z + CAMERA.cy


def inverse_depth(depth: NDArray[np.float32], u: float, v: float) -> float:
    """Of the nearest pixel that is not at the border, carried on along its surface."""
    inverse = np.where(np.isnan(depth), 0, np.float32(1) / depth).astype(float)
    column = int(np.clip(np.floor(u + 0.5), 1, CAMERA.width - 2))
    row = int(np.clip(np.floor(v + 0.5), 1, CAMERA.height - 2))
    here = inverse[row, column]
    slopes = []
    for one, other in (((0, -1), (0, 1)), ((-1, 0), (1, 0))):
        back = here - inverse[row + one[0], column + one[1]]
        ahead = inverse[row + other[0], column + other[1]] - here
        slope = min(back, ahead, key=abs)
        slopes.append(slope if abs(slope) <= MAX_SLOPE * here else 0.0)
    return float(here + slopes[0] * (u - column) + slopes[1] * (v - row))


@pytest.mark.kernel
@pytest.mark.parametrize("moving", [True, False])
def test_places_are_those_of_the_slow_twin(moving: bool) -> None:
    rng = np.random.default_rng(0)
    y, x = np.mgrid[: CAMERA.height, : CAMERA.width]
    depth = (2 + 0.01 * x + 0.02 * y + 0.003 * rng.standard_normal(x.shape)).astype(np.float32)
    depth[:, 20:33] *= 0.6
    depth[rng.random(depth.shape) < 0.03] = np.nan
    # Some rays look beside the view.
    columns, lines = np.meshgrid(np.linspace(-0.62, 0.65, WIDTH), np.linspace(-0.26, 0.24, HEIGHT))
    rays = np.stack([columns, lines, np.ones_like(lines)], axis=-1)
    share = np.linspace(-1, 1, HEIGHT)[:, None] if moving else np.zeros((HEIGHT, 1))
    turns = Rotation.from_rotvec(share * [0.01, -0.02, 0.015]).as_matrix()
    rows = RowPoses(turns, share * [0.01, 0.02, 0.015])
    places, found = places_in_view(rays, rows, depth, CAMERA)
    expected_places, expected = slowly(rays, rows, depth)
    assert 5 < np.isnan(expected).sum() < 100
    np.testing.assert_allclose(places, expected_places, rtol=1e-6, atol=1e-5)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
