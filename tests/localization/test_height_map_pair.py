"""An aerial surface on a ground map: shared by filters, and plain about what it cannot use."""

import numpy as np
import pytest

from airground.config import Config
from airground.errors import InputError
from airground.localization import height_map_pair
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.hypotheses import search_positions
from airground.localization.particle_filter import MonteCarloLocalizer
from tests.localization.synthetic import aerial_points, box_heap, ground_points

POSITION = np.array([-0.2, 0.3, 2.2])


@pytest.fixture(scope="module")
def clouds():
    rng, heap = np.random.default_rng(3), box_heap(1)
    aerial = aerial_points(heap, *POSITION[:2], rng).astype(np.float32)
    return aerial, ground_points(heap, rng, frames=20)


def paired(clouds, heading=0.0):
    aerial, ground = clouds
    return HeightMapPair(7, aerial, POSITION, ground, np.zeros(2), heading, Config())


def test_filters_that_share_one_search_once_and_find_the_same(clouds, monkeypatch):
    searches = []

    def counted(*args):
        searches.append(args)
        return search_positions(*args)

    monkeypatch.setattr(height_map_pair, "search_positions", counted)
    shared, found = paired(clouds), []
    for seed in range(3):
        for pair in (shared, paired(clouds)):
            localizer = MonteCarloLocalizer(Config(), np.random.default_rng(seed))
            *_, last = localizer.update(pair)
            found.append(last.belief.particles)
    assert len(searches) == 1 + 3
    for together, alone in zip(found[::2], found[1::2], strict=True):
        np.testing.assert_array_equal(together, alone)


def test_an_unknown_heading_is_named(clouds):
    localizer = MonteCarloLocalizer(Config(), np.random.default_rng(0))
    for heading in (None, np.nan):
        with pytest.raises(InputError, match="stamp 7: the heading"):
            list(localizer.update(paired(clouds, heading)))


def test_a_pose_lies_the_same_whatever_heading_is_known(clouds):
    """Height maps that were turned by the known heading, and those that a pose turns."""
    pose = np.array([*POSITION[:2], 0.0])
    cost_of = [
        paired(clouds, heading).costs_as_posed(pose[None])[0] for heading in (0.0, 0.05, -0.1)
    ]
    off = pose + np.array([0.2, 0.2, 0.3])
    away = paired(clouds).costs_as_posed(off[None])[0]
    np.testing.assert_allclose(cost_of, cost_of[0], rtol=0.15)
    assert away > max(cost_of) + abs(cost_of[0]) / 2
    moved = [paired(clouds, heading).lowest_nearby(pose) for heading in (0.0, 0.05, -0.1)]
    np.testing.assert_allclose(moved, [pose] * 3, atol=0.03)


def test_joined_surfaces_are_one_over_the_newest_ground_map(clouds):
    aerial, ground = clouds
    halves = aerial[::2], aerial[1::2]
    first, second = (
        HeightMapPair(stamp, half, POSITION, ground, np.zeros(2), 0.0, Config())
        for stamp, half in enumerate(halves)
    )
    joined = second.joined([first])
    assert joined.points_mav.shape == aerial.shape
    np.testing.assert_array_equal(joined.aerial.heights, paired(clouds).aerial.heights)
    assert joined.stamp_ns == second.stamp_ns
    assert second.joined([first]) is joined
    assert second.joined([]) is second
