"""Old points are found again where a keyframe's view is alike, and only there."""

from __future__ import annotations

from functools import cache

import numpy as np

from airground.slam.reacquisition import BORDER_PX, find_again, keyframes_in_view, visible
from airground.slam.sparse_map import SparseMap
from tests.slam.mapped_room import T_RIG_CAMERA, View, room_map, sees, view
from tests.slam.synthetic_world import CAMERA


@cache
def old_map() -> SparseMap:
    """From one place looking one way, looking across, from far above, and from elsewhere."""
    return room_map(
        [
            view(0.9, 0.9),
            view(0.9, 0.9, heading=0.6),
            view(0.9, 0.9, z=2.95),
            view(-1.6, -1.4),
        ]
    )


def in_view(here: View, count: int = 3, least: int = 10, stop: int = 4) -> list[int]:
    sparse_map = old_map()
    ids = np.arange(len(sparse_map))
    ids = ids[visible(sparse_map.positions[ids], here.T_map_camera, CAMERA)[1]]
    return keyframes_in_view(
        sparse_map, range(stop), here.T_map_camera, T_RIG_CAMERA, ids, count, least
    )


def test_visible_points_are_those_well_inside_and_in_front() -> None:
    here = view(0.9, 0.9)
    rng = np.random.default_rng(0)
    pixels = rng.uniform((-50, -50), (370, 290), (300, 2))
    z = rng.choice([-2.0, 1.0, 3.0], (300, 1))
    rays = np.column_stack([pixels, np.ones(300)]) @ np.linalg.inv(CAMERA.matrix()).T
    seen_px, inside = visible(here.T_map_camera @ (rays * z), here.T_map_camera, CAMERA)
    margin = np.minimum(pixels, (CAMERA.width, CAMERA.height) - pixels).min(axis=1)
    np.testing.assert_array_equal(inside, (margin >= BORDER_PX) & (z[:, 0] > 0))
    np.testing.assert_allclose(seen_px[inside], pixels[inside], atol=1e-6)


def test_keyframes_count_if_seen_from_about_there() -> None:
    assert in_view(view(0.95, 0.85)) == [0]
    assert in_view(view(0.95, 0.85, heading=0.55)) == [1]
    both = in_view(view(0.95, 0.85, heading=0.3))
    assert sorted(both) == [0, 1]
    assert in_view(view(0.95, 0.85, heading=0.3), count=1) == both[:1]
    assert in_view(view(0.95, 0.85, heading=0.3), stop=1) == [0]
    assert in_view(view(0.95, 0.85, z=2.8)) == [2]
    assert in_view(view(-1.5, -1.3)) == [3]
    assert in_view(view(-1.5, -1.3), least=1000) == []


def test_points_are_found_to_a_fraction_of_a_pixel() -> None:
    sparse_map, here = old_map(), view(0.98, 0.84, z=2.1, heading=0.1, seed=1)
    ids = np.sort(sparse_map.keyframes[0].ids)
    truth, there = sees(here, sparse_map.positions[ids])
    # A prediction that is off by two pixels.
    again, pixels = find_again(sparse_map, 0, ids[there], here.image, truth[there] + 1.5, 17, 1)
    assert len(again) > 0.7 * there.sum() > 30
    off = np.linalg.norm(pixels - truth[np.searchsorted(ids, again)], axis=1)
    assert np.median(off) < 0.3
    assert (off < 1.0).mean() > 0.9


def test_elsewhere_nothing_is_found() -> None:
    sparse_map = old_map()
    ids = np.sort(sparse_map.keyframes[0].ids)
    expected, _ = sees(view(0.9, 0.9), sparse_map.positions[ids])
    again, _ = find_again(sparse_map, 0, ids, view(-1.6, -1.4).image, expected, 17, 1)
    assert len(again) < 0.1 * len(ids)
    again, pixels = find_again(sparse_map, 0, ids[:0], view(0.9, 0.9).image, expected[:0], 17, 1)
    assert (again.shape, pixels.shape) == ((0,), (0, 2))
