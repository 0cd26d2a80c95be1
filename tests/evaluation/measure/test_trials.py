"""Overlapping sequences give the results of each alone, and compute shared steps once."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest

from airground.config import Config, paper
from airground.core.belief import Belief
from airground.core.events import BeliefUpdated, CostMapComputed, HeightMapsMade
from evaluation.measure.protocol.trials import localize_sequence, localize_sequences
from evaluation.setup.setups import with_localization
from tests.evaluation.judge.test_sabotage import Flown, fly

LENGTH, STARTS = 3, (0, 1, 3)
CONFIGS = {
    "best": Config(),
    "paper": paper(),
    "searched": with_localization(Config(), heading="search", headings=30, joint_maps=2),
}


@pytest.fixture(scope="module")
def flown() -> Flown:
    return fly(2)


@pytest.mark.parametrize("name", CONFIGS)
def test_overlapping_sequences_equal_single_ones(flown: Flown, name: str) -> None:
    config, sightings = CONFIGS[name], flown.sightings
    filters = {i: (start, np.random.default_rng(start)) for i, start in enumerate(STARTS)}
    together: dict[int, list[Belief]] = defaultdict(list)
    shared: list[int] = []
    steps = localize_sequences(sightings, LENGTH, flown.truth, config, filters)  # type: ignore[arg-type]
    for sequence, event, duration_ms, iteration in steps:
        if isinstance(event, BeliefUpdated):
            assert iteration is not None
            assert duration_ms is not None
            together[sequence].append(iteration.belief)
        if isinstance(event, (HeightMapsMade, CostMapComputed)) and duration_ms is None:
            shared.append(sequence)

    for sequence, start in enumerate(STARTS):
        part, rng = sightings[start : start + LENGTH], np.random.default_rng(start)
        alone = localize_sequence(part, flown.truth, config, rng)  # type: ignore[arg-type]
        beliefs = [iteration.belief for *_, iteration in alone if iteration is not None]
        assert len(beliefs) == len(together[sequence]) == min(LENGTH, len(sightings) - start)
        for belief, other in zip(beliefs, together[sequence], strict=True):
            np.testing.assert_array_equal(belief.particles, other.particles)
            assert belief.cost == other.cost
            assert belief.refusal == other.refusal

    # What an earlier sequence has met already is not computed, nor timed, again: the same newest
    # surface with the same ones before it.
    together_with = config.localization.maps_together - 1
    seen = [
        {(k, max(start, k - together_with)) for k in range(start, start + LENGTH)}
        for start in STARTS
    ]
    again = [
        sum((k, first) in set().union(*seen[:i]) for k, first in seen[i] if k < len(sightings))
        for i in range(3)
    ]
    heights_and_costs = 1 if name == "paper" else 2
    assert [shared.count(i) for i in range(3)] == [heights_and_costs * count for count in again]
