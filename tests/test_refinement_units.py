"""Units of refinement: lengths grow with wide and sparse maps, and hold on small ones."""

import time
from pathlib import Path

import numpy as np
import pytest

from airground.config import Config
from airground.core.se3 import SE3
from airground.refinement import refine
from airground.refinement.surfels import make_surfels
from airground.refinement.units import scale_by_extent, scale_by_spacing, scaled, without_strays
from tests.localization.synthetic import box_heap
from tests.test_refinement import T_WORLD_MAV, cloud, error, noisy, pair_of

REAL_PAIR = Path(__file__).parents[2] / "shared" / "real" / "icp_pair"
SECONDS = 20.0
"""Processor time that a slow machine may need for one alignment; without units it takes minutes."""


@pytest.fixture(scope="module")
def heap():
    world = box_heap(1)
    return pair_of(world, world)


def test_lengths_hold_on_maps_of_the_simulators_size(heap):
    settings = Config().refinement
    surfels = [make_surfels(one.points, settings.voxel_m) for one in heap]
    assert scale_by_extent(heap[0].points, settings) == 1.0
    assert scale_by_spacing(surfels, settings) == 1.0
    assert scaled(settings, 1.0) == settings


def test_lengths_grow_with_the_extent_and_with_the_spacing():
    settings = Config().refinement
    x, y = np.meshgrid(np.arange(0, 100, 0.3), np.arange(0, 50, 0.3))
    plane = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]).astype(np.float32)
    assert scale_by_extent(plane, settings) == pytest.approx(9.8, abs=0.1)
    by_spacing = scale_by_spacing([make_surfels(plane, settings.voxel_m)], settings)
    assert by_spacing == pytest.approx(0.3 / settings.spacing_m, rel=0.01)
    longer = scaled(settings, 10.0)
    assert longer.voxel_m == pytest.approx(10 * settings.voxel_m)
    assert longer.local_search_cells_per_m == pytest.approx(settings.local_search_cells_per_m / 10)
    assert longer.iterations == settings.iterations
    own = settings.model_copy(update={"extent_m": 1000.0})
    assert scale_by_extent(plane, own) == 1.0


def test_stray_points_do_not_change_the_units(heap):
    settings = Config().refinement
    strays = np.array([[900.0, 0, 0], [0, -2000, 0]], np.float32)
    kept = without_strays(np.concatenate([heap[0].points, strays]))
    np.testing.assert_array_equal(kept, heap[0].points)
    assert scale_by_extent(kept, settings) == 1.0


@pytest.mark.parametrize("times", [5.0, 25.0])
def test_a_wide_map_is_aligned_in_bounded_time(heap, times):
    """The same heap as if a hundred metres wide, from starts that are as much farther off."""
    aerial, ground = (cloud(times * one.points) for one in heap)
    rng = np.random.default_rng(1)
    for _ in range(2):
        near = noisy(rng)
        start = SE3(near.rotation, times * near.translation)
        began = time.process_time()
        alignment = refine(0, start, aerial, ground, Config())
        assert time.process_time() - began < SECONDS
        found = alignment.T_ground_mav
        metres, degrees = error(SE3(found.rotation, found.translation / times))
        assert alignment.accepted, alignment.refusal
        assert metres < 0.02
        assert degrees < 0.3


def test_a_sparse_map_is_aligned_beyond_the_gaps_of_itscloud(heap):
    aerial, ground = (cloud(make_surfels(one.points, 0.12).points) for one in heap)
    rng = np.random.default_rng(3)
    for _ in range(2):
        alignment = refine(0, noisy(rng), aerial, ground, Config())
        metres, degrees = error(alignment.T_ground_mav)
        assert alignment.accepted, alignment.refusal
        assert metres < 0.04
        assert degrees < 1.0


def test_a_wide_map_in_the_wrong_place_is_refused(heap):
    other = pair_of(box_heap(2), box_heap(2))[1]
    aerial, ground = cloud(25 * heap[0].points), cloud(25 * other.points)
    start = SE3(T_WORLD_MAV.rotation, 25 * T_WORLD_MAV.translation)
    alignment = refine(0, start, aerial, ground, Config())
    assert not alignment.accepted


@pytest.fixture(scope="module")
def lidar():
    """Source and target scan, and the published T_target_source."""
    import open3d as o3d

    if not REAL_PAIR.exists():
        pytest.skip("the real lidar pair is not on this machine")
    source, target = (
        np.asarray(o3d.io.read_point_cloud(str(REAL_PAIR / f"{name}.ply")).points)
        for name in ("source", "target")
    )
    truth = SE3.from_matrix(np.loadtxt(REAL_PAIR / "T_target_source.txt"))
    return source, target, truth


@pytest.mark.parametrize(
    ("metres", "degrees"),
    [(0.0, 0.0), (0.2, 14.0), (0.2, -14.0), (2.0, 10.0), (4.0, -14.0)],
)
def test_a_real_lidar_pair_ends_within_5_cm_with_the_defaults(lidar, metres, degrees):
    source, target, truth = lidar
    off = SE3.from_heading(np.deg2rad(degrees), (0.8 * metres, -0.6 * metres, 0.2 * metres))
    start = off @ truth if metres or degrees else SE3.identity()
    alignment = refine(0, start, cloud(source), cloud(target), Config())
    found = alignment.T_ground_mav
    assert alignment.accepted, alignment.refusal
    assert np.linalg.norm(found.translation - truth.translation) < 0.05
    assert np.rad2deg((found @ truth.inverse()).angle()) < 0.5


def test_a_mirrored_lidar_scan_is_refused(lidar):
    source, target, _ = lidar
    mirrored = cloud(source * (-1, 1, 1))
    assert not refine(0, SE3.identity(), mirrored, cloud(target), Config()).accepted
