"""Heaps: the lane stays free for any seed, boxes rest, the same seed gives the same heap."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.errors import InputError
from sim.geometry.lane import distance_to_footprint, lane_points
from sim.geometry.rubble import make_heap
from sim.scene import MAX_HEAP_HEIGHT_M, load_scene

CUBE = np.array([[x, y, z] for x in (0.0, 2.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])


@pytest.mark.parametrize(
    ("point", "distance"),
    [((3.0, 0.5), 1.0), ((1.0, 0.5), 0.0), ((-3.0, -4.0), 5.0), ((1.0, 1.5), 0.5)],
)
def test_distance_to_a_footprint(point: tuple[float, float], distance: float) -> None:
    assert distance_to_footprint(np.array([point]), CUBE) == pytest.approx(distance, abs=1e-6)


@settings(max_examples=4, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10**6), name=st.sampled_from(["tiny", "indoor_a", "indoor_b", "indoor_c"])
)
def test_no_box_stands_in_the_lane_or_too_high(seed: int, name: str) -> None:
    scene = load_scene(name)
    boxes = make_heap(scene, np.random.default_rng(seed))
    assert 0.9 * scene.rubble.boxes <= len(boxes) <= scene.rubble.boxes
    lane = lane_points(scene)
    half = np.array(scene.room.size_m) / 2
    for box in boxes:
        corners = box.corners()
        assert distance_to_footprint(lane, corners) >= scene.rubble.clearance_m
        assert corners[:, 2].min() > -0.01
        assert corners[:, 2].max() < MAX_HEAP_HEIGHT_M
        assert (np.abs(corners[:, :2]) < half).all()


def test_the_same_seed_gives_the_same_heap_and_another_one_does_not() -> None:
    scene = load_scene("tiny")
    first, again, other = (make_heap(scene, np.random.default_rng(s)) for s in (3, 3, 4))
    for a, b in zip(first, again, strict=True):
        assert (a.T_world_box.matrix() == b.T_world_box.matrix()).all()
        assert (a.size_m == b.size_m).all()
    assert any((a.size_m != b.size_m).any() for a, b in zip(first, other, strict=False))


def test_boxes_hardly_sink_into_each_other() -> None:
    """Points well inside one box lie in no other."""
    boxes = make_heap(load_scene("indoor_a"), np.random.default_rng(0))
    grid = np.stack(np.meshgrid(*[np.linspace(-0.48, 0.48, 9)] * 3), -1).reshape(-1, 3)
    for a in boxes:
        shrunk = np.maximum(a.size_m - 0.01, 0) / a.size_m
        points = a.T_world_box @ (grid * a.size_m * shrunk)
        for b in boxes:
            if b is not a:
                inside = np.abs(b.T_world_box.inverse() @ points) < b.size_m / 2 - 0.005
                assert not inside.all(axis=1).any(), (a.name, b.name)


def test_a_heap_that_does_not_fit_is_refused() -> None:
    scene = load_scene("tiny")
    rubble = scene.rubble.model_copy(update={"area_m": (0.9, 0.5), "boxes": 20})
    with pytest.raises(InputError, match=r"rubble\.boxes = 20 fit into rubble\.area_m"):
        make_heap(scene.model_copy(update={"rubble": rubble}), np.random.default_rng(0))
