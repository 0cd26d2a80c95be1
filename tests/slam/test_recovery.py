"""Back in the map: near where the robot should be, or anywhere; or not at all."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from airground.config import KeyframeSlam
from airground.core.se3 import SE3
from airground.slam.recovery import MIN_FOUND, Found, Recovery
from airground.slam.sparse_map import SparseMap
from tests.slam.mapped_room import T_RIG_CAMERA, View, room_map, sees, view
from tests.slam.synthetic_world import CAMERA
from tests.slam.textures import texture

HERE = view(0.97, 0.84, z=2.05, heading=0.1, seed=1)


@cache
def recovery() -> tuple[Recovery, SparseMap]:
    whole = room_map([view(-1.5, -1.4), view(0.9, 0.9), view(1.1, 0.8)])
    # Keyframes become known one by one, as they do in the engine.
    keyframes, whole.keyframes = whole.keyframes, []
    made = Recovery(whole, CAMERA, T_RIG_CAMERA, KeyframeSlam())
    for keyframe in keyframes:
        whole.keyframes.append(keyframe)
        made.add_keyframe()
    return made, whole


def assert_right(found: Found | None, here: View) -> None:
    assert found is not None
    off = here.T_map_camera.inverse() @ found.fit.T_map_camera
    assert np.linalg.norm(off.translation) < 0.01
    assert off.angle() < np.deg2rad(0.3)
    assert len(found.ids) == len(np.unique(found.ids)) == len(found.pixels) >= MIN_FOUND
    truth, _ = sees(here, recovery()[1].positions[found.ids])
    assert np.median(np.linalg.norm(found.pixels - truth, axis=1)) < 0.5


def test_it_looks_near_a_guess() -> None:
    guess = HERE.T_map_camera @ SE3.from_rotation_vector((0.01, -0.01, 0.02), (0.03, -0.03, 0.03))
    assert_right(recovery()[0].near(HERE.image, guess), HERE)


@pytest.mark.parametrize("here", [HERE, view(-1.45, -1.35, heading=-0.2, seed=2)])
def test_without_a_guess_it_knows_the_place(here: View) -> None:
    assert_right(recovery()[0].anywhere(here.image), here)


def test_a_wrong_guess_an_unknown_place_and_darkness_give_nothing() -> None:
    made, _ = recovery()
    assert made.near(HERE.image, view(-1.5, -1.4).T_map_camera) is None
    assert made.near(HERE.image, view(3.5, -3.5).T_map_camera) is None
    for image in (view(2.4, -2.2).image, texture(), np.zeros_like(HERE.image)):
        assert made.anywhere(image) is None
        assert made.near(image, HERE.T_map_camera) is None


def test_points_that_left_the_map_are_not_asked_for() -> None:
    _, sparse_map = recovery()
    ids = sparse_map.keyframes[1].ids[::2]
    states = sparse_map.states.copy()
    sparse_map.drop(ids)
    found = recovery()[0].anywhere(HERE.image)
    sparse_map.states[:] = states
    assert found is not None
    assert not np.isin(found.ids, ids).any()
