"""Pose at which the heights fit best: found from a rough guess, whatever has changed."""

import numpy as np
import pytest

from airground.config import Config
from airground.core.belief import HeightMap
from airground.core.height_map import make_height_map
from airground.localization.channels import ChannelOverlay
from airground.localization.height_map_pair import aerial_height_map
from airground.localization.nearby_minimum import (
    TRUNCATION_M,
    differences,
    lowest_nearby,
    truncated_squares,
)
from tests.localization.synthetic import aerial_points, box_heap, ground_points

PATH = [(-0.5, 0.2), (-0.1, 0.3), (0.3, 0.3)]
CONFIG = Config()
LOCAL = CONFIG.localization
GUESS = np.array([0.12, -0.1, np.deg2rad(4.0)])


@pytest.fixture(scope="module")
def maps():
    """Three aerial surfaces of a flight whose `mav` is the world as one, and their ground map."""
    rng, heap = np.random.default_rng(4), box_heap(1)
    ground = make_height_map(ground_points(heap, rng, frames=30), CONFIG.height_maps.cells_per_m)
    points = np.concatenate([aerial_points(heap, *place, rng) for place in PATH])
    camera = np.array([*PATH[-1], 2.2])
    return aerial_height_map(points, camera, 0.0, CONFIG.height_maps), ground


def errors(pose):
    """Horizontal distance from the truth [m], and angle [deg]."""
    return np.hypot(*(pose[:2] - PATH[-1])), abs(np.rad2deg(pose[2]))


def moved(aerial, ground, start):
    overlay = ChannelOverlay.of(aerial, ground)
    costs_at = lambda poses: overlay.costs(poses, LOCAL)  # noqa: E731
    return lowest_nearby(aerial, ground, start, costs_at, LOCAL.sigma)


def test_a_guess_moves_to_the_truth(maps):
    start = np.array([*PATH[-1], 0.0]) + GUESS
    metres, degrees = errors(moved(*maps, start))
    assert metres < 0.03
    assert degrees < 1.0


def test_changed_boxes_do_not_pull_the_minimum(maps):
    aerial, seen = maps
    heights = seen.heights.copy()
    centre = (np.array(heights.shape) // 2) + np.array([25, 0])
    heights[centre[0] - 8 : centre[0] + 8, centre[1] + 5 : centre[1] + 30] += 0.5
    ground = HeightMap(heights, seen.origin, seen.cells_per_m)
    start = np.array([*PATH[-1], 0.0]) + GUESS
    metres, degrees = errors(moved(aerial, ground, start))
    assert metres < 0.03
    assert degrees < 1.0


def test_the_result_stays_near_the_guess(maps):
    start = np.array([*PATH[-1], 0.0]) + np.array([0.5, 0.3, 0.4])
    off = moved(*maps, start) - start
    assert np.hypot(*off[:2]) <= 0.25 + 1e-9
    assert abs(off[2]) <= np.deg2rad(10.0) + 1e-9


def test_without_overlap_the_guess_stays(maps):
    start = np.array([40.0, 0.0, 1.0])
    np.testing.assert_array_equal(moved(*maps, start), start)


@pytest.mark.kernel
def test_kernels_agree_with_a_slow_twin():
    rng = np.random.default_rng(0)
    ground = rng.normal(0, 0.1, (12, 9)).astype(np.float32)
    ground[rng.random(ground.shape) < 0.2] = np.nan
    cells = np.vstack([rng.integers(-4, 5, (2, 30)), rng.normal(0, 0.1, 30)]).astype(np.float32)
    first, poses = np.array([-6.0, -4.0]), rng.uniform((-3, -3, -3), 3, (5, 3))
    for pose in poses:
        expected = np.full(30, np.nan)
        for k, (x, y, height) in enumerate(cells.T.astype(np.float64)):
            turned = complex(x, y) * np.exp(1j * pose[2]) + complex(*pose[:2])
            ix, iy = np.floor(np.array([turned.real, turned.imag]) - first + 0.5).astype(int)
            if 0 <= ix < 12 and 0 <= iy < 9:
                expected[k] = ground[ix, iy] - height
        found = differences(cells, ground, first, pose)
        np.testing.assert_allclose(found, expected, atol=1e-6)
        squares = np.minimum(((expected - 0.02) / TRUNCATION_M) ** 2, 1.0)
        mean = np.nanmean(squares) if np.isfinite(squares).any() else 1.0
        (value,) = truncated_squares(cells, ground, first, pose[None], 0.02)
        assert value == pytest.approx(mean, abs=1e-5)
