"""The sweep and its aggregation against loops; what lies outside a view says nothing."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.config import PlaneSweep as Parameters
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.dense.aggregation import MEAN_SCALE, aggregate
from airground.dense.depth_refinement import depth_from_costs
from airground.dense.plane_sweep import (
    CostVolume,
    PlaneSweep,
    TurnedView,
    Workspace,
    halved,
    inverse_depth_planes,
)
from airground.dense.sweep_kernels import COST_SCALE, plan_columns

CAMERA = PinholeCamera(48, 32, 30.0, 31.0, 22.9, 16.2)


def slow_add(
    reference: NDArray, view: TurnedView, depths: NDArray, centre: NDArray, cap: float
) -> tuple[NDArray, NDArray[np.bool_]]:
    """Costs and whether there is a sample, one pixel and plane at a time."""
    camera = CAMERA.halved()
    height, width = reference.shape
    image = view.phases.transpose(1, 0, 3, 2).reshape(2 * height, 2 * width)
    costs = np.zeros((height, len(depths), width))
    sampled = np.zeros(costs.shape, bool)
    for y, p, x in np.ndindex(*costs.shape):
        point = camera.rays()[y, x] * depths[p] - centre
        u, v = 2 * camera.project(point[None])[0]
        column, row = int(np.floor(u)), int(np.floor(v))
        if not (row >= 0 and row + 1 < 2 * height):
            continue
        lo = max(view.valid[row, 0], view.valid[row + 1, 0])
        hi = min(view.valid[row, 1], view.valid[row + 1, 1])
        if hi - lo < 4 or column < lo or column + 1 >= hi:
            continue
        a, b = u - column, v - row
        top = (1 - a) * image[row, column] + a * image[row, column + 1]
        bottom = (1 - a) * image[row + 1, column] + a * image[row + 1, column + 1]
        costs[y, p, x] = min(abs((1 - b) * top + b * bottom - reference[y, x]), cap)
        sampled[y, p, x] = True
    return costs, sampled


@pytest.mark.kernel
@pytest.mark.parametrize("centre", [(0.11, 0.02, 0.0), (-0.06, 0.09, 0.05), (0.0, -0.1, -0.07)])
def test_sweep_equals_the_loops(centre: tuple[float, float, float]) -> None:
    rng = np.random.default_rng(0)
    reference, image = rng.integers(0, 255, (2, 32, 48)).astype(np.uint8)
    depths = inverse_depth_planes(0.6, 3.0, 9)
    sweep = PlaneSweep(reference, CAMERA, SE3.identity(), depths, Parameters(), 1)
    pose = SE3.from_rotation_vector((0.06, -0.04, 0.1), centre)
    sweep.add(image, pose, 0)
    view = TurnedView.turn(image, CAMERA, pose.rotation.T)
    view = view.scaled(sweep._gain(view, pose.translation))
    costs, sampled = slow_add(
        halved(reference), view, depths, pose.translation, Parameters().truncation
    )
    limits = sweep.volumes[0].limits[0]
    columns = np.arange(24)
    found = (columns >= limits[..., :1]) & (columns < limits[..., 1:])
    # a column that falls on a whole number may land on either side of it
    assert (found == sampled).mean() > 0.999
    fast = sweep.volumes[0].costs / COST_SCALE
    assert (fast[~found] == 0).all()
    both = found & sampled
    assert both.mean() > 0.5
    np.testing.assert_allclose(fast[both], costs[both], atol=0.6 / COST_SCALE + 0.01)


def test_no_rotation_leaves_the_image_as_it_is() -> None:
    image = np.random.default_rng(1).integers(0, 255, (32, 48)).astype(np.uint8)
    view = TurnedView.turn(image, CAMERA, np.eye(3))
    np.testing.assert_allclose(view.phases[0, :, 0, :], halved(image), atol=1e-3)
    assert (view.valid[:-1] == (0, 47)).all()
    assert (view.valid[-1] == 0).all()


@given(near=st.floats(0.3, 3.0), ratio=st.floats(1.05, 6.0), count=st.integers(2, 300))
def test_planes_are_even_in_inverse_depth(near: float, ratio: float, count: int) -> None:
    depths = inverse_depth_planes(near, near * ratio, count)
    steps = np.diff(1 / depths)
    assert depths[0] == pytest.approx(near)
    assert depths[-1] == pytest.approx(near * ratio)
    np.testing.assert_allclose(steps, steps[0], rtol=1e-6)


@pytest.mark.parametrize("limits", [(0.0, 1.0), (2.0, 1.0), (np.nan, 1.0)])
def test_impossible_range_is_refused(limits: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="0 < near < far"):
        inverse_depth_planes(*limits, 10)


@pytest.mark.kernel
@given(scale=st.floats(1.85, 2.15), shift=st.floats(-40, 40))
def test_runs_tile_the_row(scale: float, shift: float) -> None:
    starts, offsets, fractions = plan_columns(np.array([scale]), np.array([shift]), 200)
    x = np.arange(200)
    run = np.searchsorted(starts[0], x, side="right") - 1
    np.testing.assert_allclose(
        2 * x + offsets[0, run] + fractions[0].astype(float), scale * x + shift, atol=1e-5
    )


def test_aggregation_divides_by_the_samples_that_exist() -> None:
    rng = np.random.default_rng(2)
    volumes = []
    for _ in range(2):
        volume = CostVolume(np.zeros((17, 5, 20), np.uint16))
        for _ in range(3):
            lo = rng.integers(0, 12, (17, 5))
            hi = np.minimum(lo + rng.integers(0, 14, (17, 5)), 20)
            volume.limits.append(np.stack([lo, hi], -1).astype(np.int16))
            columns = np.arange(20)
            covered = (columns >= lo[..., None]) & (columns < hi[..., None])
            volume.costs += (covered * rng.integers(0, 600, covered.shape)).astype(np.uint16)
        volumes.append(volume)
    columns = np.arange(20)
    sums = [volume.costs.astype(int) for volume in volumes]
    counts = [
        sum(
            ((columns >= one[..., :1]) & (columns < one[..., 1:])).astype(int)
            for one in volume.limits
        )
        for volume in volumes
    ]
    both, single = (aggregate(some, 5, 40.0, 2.0, Workspace()) for some in (volumes, volumes[1:]))
    for y, p, x in np.ndindex(17, 5, 20):
        window = np.s_[max(y - 2, 0) : y + 3, p, max(x - 2, 0) : x + 3]
        costs = [one[window].sum() / COST_SCALE for one in sums]
        samples = [one[window].sum() for one in counts]
        sides = [c / n if n else 40.0 for c, n in zip(costs, samples, strict=True)]
        mean = sum(costs) / sum(samples) if sum(samples) else 40.0
        expected = min(mean, min(sides) + 2.0) * MEAN_SCALE
        assert abs(int(both[y, x, p]) - expected) <= 1.01
        assert abs(int(single[y, x, p]) - sides[1] * MEAN_SCALE) <= 1.01


def test_many_views_in_a_large_window_are_all_counted() -> None:
    height, planes, width, views, each = 50, 2, 60, 20, 8.0
    costs = np.full((height, planes, width), views * each * COST_SCALE, np.uint16)
    whole = np.broadcast_to(np.array([0, width], np.int16), (height, planes, 2))
    volume = CostVolume(costs)
    volume.limits = [whole] * views
    mean = aggregate([volume], 47, 40.0, 1.0, Workspace())
    np.testing.assert_allclose(mean, each * MEAN_SCALE, atol=1.01)


def test_window_must_have_a_middle() -> None:
    empty = CostVolume(np.zeros((4, 3, 5), np.uint16))
    with pytest.raises(ValueError, match="odd"):
        aggregate([empty], 4, 40.0, 1.0, Workspace())
    with pytest.raises(ValueError, match="no view"):
        aggregate([empty], 3, 40.0, 1.0, Workspace())


def test_exposure_and_vignetting_of_a_view_do_not_matter() -> None:
    rng = np.random.default_rng(3)
    camera = PinholeCamera(240, 160, 134.0, 134.0, 119.5, 79.5)
    image = rng.integers(60, 140, (160, 240)).astype(np.float64)
    tilt = 1.2 + 0.1 * np.linspace(-1, 1, 240) - 0.05 * np.linspace(-1, 1, 160)[:, None]
    depths = inverse_depth_planes(1.0, 2.0, 9)
    reference = np.round(image).astype(np.uint8)
    sweep = PlaneSweep(reference, camera, SE3.identity(), depths, Parameters(), 1)
    sweep.add(np.round(image * tilt).astype(np.uint8), SE3.identity(), 0)
    assert sweep.volumes[0].costs.mean() / COST_SCALE < 1.0


@pytest.mark.parametrize("smoothing", ["none", "semiglobal"])
def test_used_memory_leaves_no_trace(smoothing: str) -> None:
    rng = np.random.default_rng(4)
    images = rng.integers(0, 255, (3, 32, 48)).astype(np.uint8)
    parameters = Parameters(smoothing=smoothing)
    depths = inverse_depth_planes(0.6, 3.0, 16)

    def depth_map(workspace: Workspace) -> NDArray:
        sweep = PlaneSweep(images[0], CAMERA, SE3.identity(), depths, parameters, 2, workspace)
        for side in (0, 1):
            pose = SE3(np.eye(3), np.array([0.1 - 0.2 * side, 0.02, 0.03]))
            sweep.add(images[1 + side], pose, side)
        depth = depth_from_costs(sweep, parameters)
        sweep.release()
        return depth

    used = Workspace()
    for _ in range(4):
        used.give(rng.integers(0, 65536, 16 * depths.size * 24).astype(np.uint16))
    first = depth_map(used)
    np.testing.assert_array_equal(first, depth_map(Workspace()))
    np.testing.assert_array_equal(first, depth_map(used))
    assert np.isfinite(first).any()


@pytest.mark.parametrize(
    "turn_deg", [(0, 0, 0), (3, 0, 0), (0, -4, 0), (0, 0, 12), (2, 5, -20), (50, 0, 3)]
)
def test_a_view_covers_the_columns_that_opencv_fills(turn_deg: tuple[float, float, float]) -> None:
    """Warping an image that is white all over shows which pixels were seen."""
    rotation = Rotation.from_euler("xyz", turn_deg, degrees=True).as_matrix()
    white = np.full((CAMERA.height, CAMERA.width), 255, np.uint8)
    matrix = CAMERA.matrix()
    seen = (
        cv2.warpPerspective(
            white,
            matrix @ rotation @ np.linalg.inv(matrix),
            (CAMERA.width, CAMERA.height),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        )
        == 255
    )
    means = seen[:-1, :-1] & seen[1:, :-1] & seen[:-1, 1:] & seen[1:, 1:]
    valid = TurnedView.turn(white, CAMERA, rotation).valid
    columns = np.arange(CAMERA.width - 1)
    filled = (columns >= valid[:-1, :1]) & (columns < valid[:-1, 1:])
    # OpenCV rounds places to 1/32 px, so that a few pixels along the edge differ.
    assert (filled[: len(means)] != means).mean() < 0.01
