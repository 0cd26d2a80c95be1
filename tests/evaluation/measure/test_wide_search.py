"""Wide searches find the true place, and the lead follows from the cost map."""

from __future__ import annotations

import numpy as np
import pytest

from airground.config import Config
from airground.core.belief import CostMap
from airground.core.events import CostMapComputed
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.pipeline import locate
from evaluation.measure.protocol import wide_search
from evaluation.measure.protocol.wide_search import STAGE, WORST, add_wide_searches, lead_of
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from tests.evaluation.judge.test_sabotage import CONDITION, Flown, fly


@pytest.fixture(scope="module")
def flown() -> Flown:
    return fly(1)


def cost_map(costs: dict[tuple[int, int], float], fill: float = 1.0) -> CostMap:
    """4 cells/m; cell (10, 20) is at (1.5, 3)."""
    grid = np.full((30, 40), fill, np.float32)
    for cell, cost in costs.items():
        grid[cell] = cost
    return CostMap(grid, np.array([-1.0, -2.0]), 4.0, 0.0, "ncc")


PLACE = np.array([1.5, 3.0])


def test_the_lead_compares_with_the_best_other_place() -> None:
    assert lead_of(cost_map({(10, 20): 0.2, (2, 3): 0.7}), PLACE) == pytest.approx(0.5)
    assert lead_of(cost_map({(10, 20): 0.7, (2, 3): 0.2}), PLACE) == pytest.approx(-0.5)


def test_neighbours_of_the_true_place_are_not_compared() -> None:
    # One cell off is still the place, two cells off neither it nor another, three are another.
    assert lead_of(cost_map({(11, 20): 0.2}), PLACE) == pytest.approx(0.8)
    assert lead_of(cost_map({(12, 20): 0.2}), PLACE) == pytest.approx(0.0)
    assert lead_of(cost_map({(13, 20): 0.2}), PLACE) == pytest.approx(-0.8)


def test_places_without_a_cost_have_the_worst_cost() -> None:
    assert lead_of(cost_map({(2, 3): 0.4}, fill=np.nan), PLACE) == pytest.approx(0.4 - WORST["ncc"])
    assert lead_of(cost_map({(10, 20): 0.4}, fill=np.nan), PLACE) == pytest.approx(
        WORST["ncc"] - 0.4
    )


def test_each_aerial_map_is_located_in_a_wider_region(flown: Flown) -> None:
    out = RowWriter("heap", flown.seed, 0, CONDITION)
    add_wide_searches(out, flown.sightings, flown.truth, Config(), (flown.seed, 0), 3)  # type: ignore[arg-type]
    table = ResultTable.from_rows(out.rows)
    assert set(table.frame["stage"]) == {STAGE}
    last = len(flown.sightings) - 1
    for metric in ("error_m", "lead", "converged"):
        assert list(table.rows(STAGE, metric)["trial"]) == [0, round(last / 2), last]
    assert (table.values(STAGE, "error_m") < 0.1).all()
    assert (table.values(STAGE, "lead") > 0).all()

    # The plain search of the same map sees fewer rivals, and the winner leads by no less.
    sighting = flown.sightings[0]
    localizer = MonteCarloLocalizer(Config(), np.random.default_rng(0))
    (narrow,) = [e.cost_map for e in locate(localizer, sighting) if isinstance(e, CostMapComputed)]
    place = flown.truth.T_world_mav_camera(sighting.mav_stamp_ns).translation[:2]
    assert lead_of(narrow, place) >= table.values(STAGE, "lead")[0] - 1e-3


def test_the_region_reaches_twice_as_far(flown: Flown, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Config] = []

    def listen(_sightings: object, _truth: object, config: Config, _rng: object) -> list[object]:
        asked.append(config)
        return []

    monkeypatch.setattr(wide_search, "localize_sequence", listen)
    out = RowWriter("heap", flown.seed, 0, CONDITION)
    add_wide_searches(out, flown.sightings, flown.truth, Config(), (0, 0), 2)  # type: ignore[arg-type]
    assert [config.localization.search_radius_m for config in asked] == [9.0, 9.0]


def test_without_aerial_maps_there_are_no_rows(flown: Flown) -> None:
    out = RowWriter("heap", flown.seed, 0, CONDITION)
    add_wide_searches(out, [], flown.truth, Config(), (0, 0), 3)  # type: ignore[arg-type]
    add_wide_searches(out, flown.sightings, flown.truth, Config(), (0, 0), 0)  # type: ignore[arg-type]
    assert out.rows == []
