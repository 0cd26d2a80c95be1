"""Few negative cases, always the same; `python -m tests.negatives` tries thousands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from airground.config import Config
from evaluation.setup.setups import with_localization
from evaluation.show.figures.style import write_png
from tests.localization.synthetic import flat_world
from tests.negatives import worlds
from tests.negatives.campaign import ORDER, Outcome, outcomes, table, tries
from tests.negatives.flights import load, store
from tests.negatives.kinds import NEGATIVES, PLACES
from tests.negatives.picture import tries_figure
from tests.negatives.views import Flown

MAPS = 4


@pytest.fixture(scope="module")
def flown():
    """Two piles and a floor, in place of recorded flights."""
    rng = np.random.default_rng(0)
    piles = [Flown(f"pile {k}", tuple(worlds.same(rng, MAPS))) for k in range(2)]
    floor = worlds.fly(flat_world(), flat_world(), rng, MAPS)
    return [*piles, Flown("floor", tuple(floor))]


def cases(kind, number):
    """The numbers of the first cases of a kind, the heading known."""
    return [k for k in range(2 * len(ORDER)) if ORDER[k % len(ORDER)] == kind][:number]


@pytest.mark.slow(minutes=1)
def test_no_place_is_claimed_where_there_is_none_and_most_are_where_there_is(flown):
    found = list(outcomes(1, range(len(ORDER)), flown, Config()))
    assert [one.line() for one in found if one.is_wrong] == []
    places = [one for one in found if one.kind in ("heap", "pile")]
    assert np.mean([one.claimed for one in places]) > 0.6
    assert {one.kind for one in found} == {*NEGATIVES, *PLACES}


def test_rows_are_claimed_wrongly_without_the_limit_of_self_similarity(flown):
    free = with_localization(Config(), max_self_similarity=1.0, min_lead=0.0)
    limited = with_localization(Config(), min_lead=0.0)
    numbers = cases("rows, moved", 4)
    assert any(one.is_wrong for one in outcomes(0, numbers, flown, free))
    for config in (limited, Config()):
        assert not any(one.claimed for one in outcomes(0, numbers, flown, config))


def test_the_picture_shows_both_maps_where_they_differ(flown, tmp_path):
    (one,) = list(tries(0, cases("flat", 1), flown, Config()))[:1]
    write_png(tries_figure([one, one]), tmp_path / "case.png")
    picture = np.asarray(Image.open(tmp_path / "case.png").convert("RGB"))
    height, width = picture.shape[:2]
    assert width > height > width / 3
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50


def test_a_cut_map_leaves_a_tenth_of_the_surface_over_it(flown):
    view = flown[0].views[0]
    cut = view.cut(0.1, lambda points: points[:, 0])
    aerial = view.T_ground_mav @ view.aerial
    assert np.mean(aerial[:, 0] > cut.ground[:, 0].min()) == pytest.approx(0.1, abs=0.02)
    assert cut.T_ground_mav is None


def test_views_survive_their_file(flown, tmp_path):
    views = list(flown[0].views)
    store(tmp_path / "pile.npz", views)
    for one, other in zip(load(tmp_path / "pile.npz").views, views, strict=True):
        np.testing.assert_array_equal(one.aerial, other.aerial)
        np.testing.assert_array_equal(one.ground, other.ground)
        np.testing.assert_array_equal(one.camera, other.camera)
        np.testing.assert_array_equal(one.robot, other.robot)
        np.testing.assert_array_equal(one.T_ground_mav.rotation, other.T_ground_mav.rotation)
        assert one.heading == other.heading
    assert [path.name for path in tmp_path.iterdir()] == ["pile.npz"]


def test_the_table_counts_what_is_wrong():
    refused = Outcome(0, 1, "flat", False, False, False, False, False, False, ("flat", ""), np.nan)
    claimed = replace(refused, claimed=True, claimed_wrongly=True, aligned=True)
    right = replace(claimed, kind="heap", claimed_wrongly=False, accepted=True)
    lines = table([refused, claimed, right]).splitlines()
    assert lines[2].startswith("| flat | 2 | 1 | 1 [")
    assert lines[-1].startswith("| heap | 1 | 1 | 0 [")
