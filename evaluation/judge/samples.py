"""The values of one metric, by flight, in an order that another run repeats."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pandas as pd

from evaluation.measure.protocol import wide_search
from evaluation.table.rows import SEQUENCE_KEYS, TRIAL_KEYS, ResultTable

LOCATED_M = 0.25
"""Beyond this a claimed position is wrong."""
REFINED_M, REFINED_DEG = 0.05, 2.0
DIGITS = 5
"""Significant digits kept: far finer than any effect that matters, and short in a file."""


class Flight(NamedTuple):
    """One flight over one heap: flights are independent, what happens in one is not."""

    scene: str
    seed: int
    flight: int

    def __str__(self) -> str:
        return f"{self.scene}/{self.seed}/{self.flight}"


Samples = dict[Flight, list[float]]
"""Values in order of their sequence, iteration or trial; a missing last one just ends."""

Take = Callable[[ResultTable], pd.Series]
"""Values whose index begins with scene, seed and flight, and tells the order after that."""

_FLIGHT = SEQUENCE_KEYS[:3]


def flights(table: ResultTable) -> list[Flight]:
    """Every flight of which the table says anything, sorted."""
    unique = table.frame[_FLIGHT].drop_duplicates().itertuples(index=False)
    return sorted(Flight(str(scene), int(seed), int(flight)) for scene, seed, flight in unique)


def by_flight(table: ResultTable, taken: pd.Series, failure: float) -> Samples:
    """The values of every flight of the table, none for a flight that gave none."""
    made: Samples = {flight: [] for flight in flights(table)}
    ordered = taken.sort_index()
    levels = [ordered.index.get_level_values(level) for level in range(len(_FLIGHT))]
    for scene, seed, flight, value in zip(*levels, ordered, strict=True):
        kept = failure if np.isnan(value) else float(f"{value:.{DIGITS}g}")
        made[Flight(str(scene), int(seed), int(flight))].append(kept)
    return made


def values(stage: str, metric: str) -> Take:
    """The rows of one metric."""

    def take(table: ResultTable) -> pd.Series:
        rows = table.rows(stage, metric)
        return rows.assign(trial=rows["trial"].fillna(0)).set_index([*_FLIGHT, "trial"])["value"]

    return take


def surfaces_a_flight(table: ResultTable) -> pd.Series:
    """How many aerial surfaces each flight gave, 0 included."""
    counted = table.rows("surface", "completeness").groupby(_FLIGHT)["value"].count()
    everyone = pd.MultiIndex.from_frame(table.frame[_FLIGHT].drop_duplicates())
    return counted.reindex(everyone, fill_value=0)


def localization(metric: str, iteration: int) -> Take:
    """A metric after so many aerial maps; NaN where a sequence ended before."""

    def take(table: ResultTable) -> pd.Series:
        wide = table.sequences(metric)
        if iteration in wide.columns:
            return wide[iteration]
        return pd.Series(np.nan, wide.index)

    return take


def located(iteration: int, limit_m: float) -> Take:
    """1 where the error is within the limit, else 0."""
    error = localization("error_m", iteration)
    return lambda table: (error(table) <= limit_m).astype(float)


def widely_located(limit_m: float) -> Take:
    """1 where a wide search ended within the limit, else 0."""
    error = values(wide_search.STAGE, "error_m")
    return lambda table: (error(table) <= limit_m).astype(float)


def claimed(table: ResultTable) -> pd.Series:
    """1 where a position was claimed after an aerial map, else 0."""
    return _beliefs(table, "converged")


def claimed_wrongly(table: ResultTable) -> pd.Series:
    """1 where a position was claimed that is wrong, else 0."""
    right = _beliefs(table, "error_m") <= LOCATED_M
    return ((claimed(table) > 0) & ~right).astype(float)


def refined(metric: str) -> Take:
    """One metric of every refinement trial."""

    def take(table: ResultTable) -> pd.Series:
        trials = table.trials()
        return trials[metric] if metric in trials else _nothing(TRIAL_KEYS)

    return take


def refined_well(table: ResultTable) -> pd.Series:
    """1 where a refinement was accepted and right, else 0."""
    return ((refined("accepted")(table) > 0) & _right(table)).astype(float)


def refined_wrongly(table: ResultTable) -> pd.Series:
    """1 where a refinement was accepted and wrong, else 0."""
    return ((refined("accepted")(table) > 0) & ~_right(table)).astype(float)


def _right(table: ResultTable) -> pd.Series:
    position = refined("after_translation_m")(table) <= REFINED_M
    return position & (refined("after_rotation_deg")(table) <= REFINED_DEG)


def _beliefs(table: ResultTable, metric: str) -> pd.Series:
    return table.rows("localization", metric).set_index([*SEQUENCE_KEYS, "iteration"])["value"]


def _nothing(keys: list[str]) -> pd.Series:
    empty = pd.MultiIndex.from_arrays([[] for _ in keys], names=keys)
    return pd.Series([], index=empty, dtype=np.float64)
