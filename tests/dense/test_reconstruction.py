"""The whole of Section V on closed-form worlds: planes, a step, hovering, threads."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from numpy.typing import NDArray

from airground.config import Config, Fusion, PlaneSweep, ViewSelection, paper
from airground.core.events import (
    DepthMapMade,
    Event,
    FieldAdded,
    FrameAdded,
    SurfaceCast,
    VolumeFused,
)
from airground.core.se3 import SE3
from airground.dense.reconstruction import DenseReconstruction
from airground.dense.scene_extent import scene_extent
from airground.dense.view_selection import PosedImage
from tests.dense import synthetic
from tests.dense.synthetic import SMALL_CAMERA as CAMERA

SMALL = Config(
    view_selection=ViewSelection(max_views=16, min_views=5),
    plane_sweep=PlaneSweep(hypotheses=64),
    fusion=Fusion(voxels=(120, 80, 60), min_depth_maps=2),
)
Flight = tuple[synthetic.World, list[SE3], list[NDArray]]


@pytest.fixture(scope="module")
def step_flight() -> Flight:
    world = synthetic.step_world()
    poses = synthetic.flight(22, step_m=0.022)
    rng = np.random.default_rng(0)
    images = [
        synthetic.noisy(world.grey(CAMERA, pose), rng, 1.0, gain=1 + 0.02 * i / 22)
        for i, pose in enumerate(poses)
    ]
    return world, poses, images


def reconstruct(config: Config, poses: list[SE3], images: list[NDArray]) -> list[Event]:
    return fly(DenseReconstruction(CAMERA, config), poses, images)


def fly(dense: DenseReconstruction, poses: list[SE3], images: list[NDArray]) -> list[Event]:
    events: list[Event] = []
    for i, (pose, image) in enumerate(zip(poses, images, strict=True)):
        events += dense.add(i * 33_333_333, image, pose)
    return events + list(dense.flush())


@pytest.fixture(scope="module")
def step_events(step_flight: Flight) -> list[Event]:
    return reconstruct(SMALL, *step_flight[1:])


def test_reserved_memory_serves_the_first_surface(
    step_flight: Flight, step_events: list[Event]
) -> None:
    dense = DenseReconstruction(CAMERA, SMALL)
    dense.reserve()
    taken = dense._fusion._memory, dense._counts
    events = fly(dense, *step_flight[1:])
    assert taken[0] is dense._fusion._memory
    assert taken[1] is dense._counts
    expected, made = (
        next(event.surface for event in some if isinstance(event, SurfaceCast))
        for some in (step_events, events)
    )
    np.testing.assert_array_equal(made.depth, expected.depth)


def test_step_is_recovered(step_flight: Flight, step_events: list[Event]) -> None:
    world = step_flight[0]
    (cast,) = [event for event in step_events if isinstance(event, SurfaceCast)]
    surface = cast.surface
    truth = world.depth(surface.camera, surface.T_mav_camera)
    error = surface.depth - truth
    assert np.isfinite(error).mean() > 0.75
    # 10 mm of depth are a 60th of a pixel of this small camera between its farthest views
    assert np.nanmedian(np.abs(error)) < 0.015
    for level in (0.0, 0.3):
        points = surface.cloud_mav.points
        near = np.abs(points[:, 2] - level) < 0.1
        assert np.median(points[near, 2]) == pytest.approx(level, abs=0.01)
    assert surface.depth_maps >= 2


def test_events_come_in_the_order_of_figure_4(step_events: list[Event]) -> None:
    kinds = [type(event) for event in step_events]
    maps = kinds.count(DepthMapMade)
    assert kinds[-maps - 2 :] == [FieldAdded] * maps + [VolumeFused, SurfaceCast]
    assert kinds.index(FrameAdded) < kinds.index(DepthMapMade)
    made = [event.depth_map for event in step_events if isinstance(event, DepthMapMade)]
    for depth_map in made:
        added = [
            event
            for event in step_events
            if isinstance(event, FrameAdded) and event.reference_stamp_ns == depth_map.stamp_ns
        ]
        assert len(added) == depth_map.views >= SMALL.view_selection.min_views
    stamps = [depth_map.stamp_ns for depth_map in made]
    assert stamps == sorted(set(stamps))


def test_preset_paper_uses_the_views_that_follow(step_flight: Flight) -> None:
    config = paper().model_copy(
        update={"plane_sweep": PlaneSweep(hypotheses=64, window_px=5, smoothing="none")}
    )
    events = reconstruct(config, *step_flight[1:])
    assert any(isinstance(event, DepthMapMade) for event in events)
    for event in events:
        if isinstance(event, FrameAdded):
            assert event.stamp_ns > event.reference_stamp_ns


def test_threads_do_not_change_the_result(step_flight: Flight, step_events: list[Event]) -> None:
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        alone = reconstruct(SMALL, *step_flight[1:])
    finally:
        numba.set_num_threads(before)
    (first,) = [event.surface for event in step_events if isinstance(event, SurfaceCast)]
    (second,) = [event.surface for event in alone if isinstance(event, SurfaceCast)]
    assert first.depth.tobytes() == second.depth.tobytes()
    assert first.cloud_mav.points.tobytes() == second.cloud_mav.points.tobytes()


def test_hovering_and_low_flight_make_nothing(step_flight: Flight) -> None:
    _, poses, images = step_flight
    still = reconstruct(SMALL, [poses[0]] * 12, [images[0]] * 12)
    assert still == []
    low = SMALL.model_copy(update={"view_selection": ViewSelection(min_depth_m=5.0)})
    assert reconstruct(low, poses[:14], images[:14]) == []


def test_image_of_another_size_is_refused() -> None:
    dense = DenseReconstruction(CAMERA, SMALL)
    with pytest.raises(ValueError, match="image at 7 is 10x20, the camera 240x160"):
        list(dense.add(7, np.zeros((20, 10), np.uint8), SE3.identity()))


def test_extent_holds_the_scene(step_flight: Flight) -> None:
    world, poses, images = step_flight
    views = [PosedImage(i, images[i], poses[i]) for i in range(6)]
    extent = scene_extent(views[5], views[:5], CAMERA)
    truth = world.depth(CAMERA, poses[5])
    assert extent is not None
    assert 0.6 * truth.min() < extent.near_m < truth.min()
    assert truth.max() < extent.far_m < 1.5 * truth.max()


def test_extent_of_a_blank_scene_is_unknown(step_flight: Flight) -> None:
    poses = step_flight[1]
    blank = np.full((CAMERA.height, CAMERA.width), 90, np.uint8)
    views = [PosedImage(i, blank, poses[i]) for i in range(6)]
    assert scene_extent(views[5], views[:5], CAMERA) is None
    assert scene_extent(views[5], [], CAMERA) is None


def test_a_sparse_map_widens_the_extent_and_never_cuts_it(step_flight: Flight) -> None:
    _, poses, images = step_flight
    views = [PosedImage(i, images[i], poses[i]) for i in range(6)]
    alone = scene_extent(views[5], views[:5], CAMERA)
    assert alone is not None
    middle = 0.5 * (alone.near_m + alone.far_m)
    assert scene_extent(views[5], views[:5], CAMERA, (0.99 * middle, 1.01 * middle)) == alone
    wide = scene_extent(views[5], views[:5], CAMERA, (0.5 * alone.near_m, 2 * alone.far_m))
    assert wide is not None
    assert wide.near_m < 0.5 * alone.near_m
    assert wide.far_m > 2 * alone.far_m
    blank = [PosedImage(i, np.full_like(images[i], 90), poses[i]) for i in range(6)]
    mapped = scene_extent(blank[5], blank[:5], CAMERA, (1.0, 2.0))
    assert mapped is not None
    assert (mapped.near_m, mapped.far_m) == pytest.approx((0.94, 2.12))
