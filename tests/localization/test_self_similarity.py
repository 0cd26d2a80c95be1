"""Maps that fit themselves elsewhere: rows do, heaps, ridges and floors do not."""

import numpy as np
import pytest

from airground.config import Config
from airground.core.belief import HeightMap
from airground.localization.self_similarity import repetition, why_ambiguous

CONFIG = Config().localization
CELLS_PER_M = 25.0


def why_refused(heights, config=CONFIG):
    """Of a map over itself."""
    return why_ambiguous(heights, heights, heights, config)


def height_map(heights):
    noise = np.random.default_rng(0).normal(0, 0.005, heights.shape)
    return HeightMap((heights + noise).astype(np.float32), np.array([-2.0, -1.2]), CELLS_PER_M)


def row(period_cells, tops):
    """A row of boxes of 0.4 x 0.4 m, one for each of the heights, on 4 x 2.4 m of floor."""
    heights = np.zeros((100, 60))
    for k, top in enumerate(tops):
        heights[8 + k * period_cells : 18 + k * period_cells, 25:35] = top
    return heights


@pytest.mark.parametrize("period_cells", [18, 25])
def test_a_row_of_identical_boxes_repeats_by_its_period(period_cells):
    whole = height_map(row(period_cells, [0.3] * (90 // period_cells)))
    found = repetition(whole, whole, whole.filled_cells, CONFIG)
    assert found == pytest.approx(period_cells / CELLS_PER_M, abs=0.13)
    assert why_refused(whole).startswith("self-similar: shifted by ")


def test_an_end_of_a_row_may_lie_off_the_map_where_its_other_boxes_fit_everywhere():
    aerial = height_map(row(22, [0.3, 0.3, 0.9]))
    ground = np.full((140, 60), np.nan)
    ground[:80] = row(22, [0.3] * 4)[:80]
    laid = HeightMap(aerial.heights, aerial.origin + np.array([22 / CELLS_PER_M, 0.0]), CELLS_PER_M)
    assert why_ambiguous(aerial, aerial, aerial, CONFIG) == ""
    refusal = why_ambiguous(aerial, laid, height_map(ground), CONFIG)
    assert refusal.endswith("the ground map fits itself")


def ridge():
    heights = np.zeros((100, 60))
    heights[:, 25:35] = 0.4
    return heights


def heap():
    rng, heights = np.random.default_rng(1), np.zeros((100, 60))
    for x, y in rng.integers(0, (90, 50), (25, 2)):
        nx, ny = rng.integers(5, 14, 2)
        heights[x : x + nx, y : y + ny] = rng.uniform(0.15, 0.6)
    return heights


@pytest.mark.parametrize(
    "heights",
    [row(30, [0.2, 0.5, 0.9]), ridge(), heap(), np.zeros((100, 60))],
    ids=["boxes that differ", "ridge", "heap", "floor"],
)
def test_other_maps_do_not(heights):
    assert why_refused(height_map(heights)) == ""


def test_a_map_without_points_does_not():
    empty = HeightMap(np.full((1, 1), np.nan, np.float32), np.zeros(2), CELLS_PER_M)
    assert why_refused(empty) == ""


def test_a_limit_of_one_turns_it_off():
    free = CONFIG.model_copy(update={"max_self_similarity": 1.0})
    assert why_refused(height_map(row(25, [0.3] * 3)), free) == ""
