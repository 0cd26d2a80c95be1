"""Finds the values of a metric in a table of results, ordered as another run repeats them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pandas as pd

from evaluation.measure.protocol import wide_search
from evaluation.table.limits import LOCATED_M, is_good_pose
from evaluation.table.rows import ALIGNMENT_STAGE, SEQUENCE_KEYS, TRIAL_KEYS, ResultTable

DIGITS = 5
"""Significant digits kept: far finer than any effect that matters, and short in a file."""


class Flight(NamedTuple):
    """One flight over one scene: flights are independent, what happens in one is not."""

    scene: str
    seed: int
    flight: int

    def __str__(self) -> str:
        return f"{self.scene}/{self.seed}/{self.flight}"


Samples = dict[Flight, list[float]]
"""Values in order of their sequence, iteration or trial; a missing last one is left out."""

Take = Callable[[ResultTable], pd.Series]
"""Values with an index of scene, seed, flight and what orders the values of one flight."""

_FLIGHT = SEQUENCE_KEYS[:3]


def flights(table: ResultTable) -> list[Flight]:
    """Every flight of which the table has a row, sorted."""
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


def magnitudes(stage: str, metric: str) -> Take:
    signed = values(stage, metric)
    return lambda table: signed(table).abs()


def surfaces_a_flight(table: ResultTable) -> pd.Series:
    """Number of aerial surfaces of each flight, 0 included."""
    counted = table.rows("surface", "completeness").groupby(_FLIGHT)["value"].count()
    everyone = pd.MultiIndex.from_frame(table.frame[_FLIGHT].drop_duplicates())
    return counted.reindex(everyone, fill_value=0)


def localization(metric: str, iteration: int) -> Take:
    """A metric after a number of aerial maps; NaN where a sequence ended before."""

    def take(table: ResultTable) -> pd.Series:
        wide = table.sequences(metric)
        if iteration in wide.columns:
            return wide[iteration]
        return pd.Series(np.nan, wide.index)

    return take


def located(iteration: int, limit_m: float, limit_deg: float = np.inf) -> Take:
    """1 where the errors of position and heading are within their limits, else 0.
    Without measured headings, a limited heading has no values."""
    off_m, off_deg = localization("error_m", iteration), localization("error_deg", iteration)

    def take(table: ResultTable) -> pd.Series:
        near = off_m(table) <= limit_m
        if np.isinf(limit_deg):
            return near.astype(float)
        if len(table.values("localization", "error_deg")) == 0:
            return _nothing(SEQUENCE_KEYS)
        return (near & (off_deg(table) <= limit_deg)).astype(float)

    return take


def widely_located(limit_m: float) -> Take:
    """1 where a wide search ended within the limit, else 0."""
    error = values(wide_search.STAGE, "error_m")
    return lambda table: (error(table) <= limit_m).astype(float)


def claimed(table: ResultTable) -> pd.Series:
    """1 where a position was claimed after an aerial map, else 0."""
    return _beliefs(table, "converged")


def claimed_wrongly(table: ResultTable) -> pd.Series:
    """1 where a position was claimed that is off by more than `LOCATED_M`, else 0."""
    right = _beliefs(table, "error_m") <= LOCATED_M
    return ((claimed(table) > 0) & ~right).astype(float)


def refined(metric: str) -> Take:
    """One metric of every refinement trial."""

    def take(table: ResultTable) -> pd.Series:
        trials = table.trials()
        return trials[metric] if metric in trials else _nothing(TRIAL_KEYS)

    return take


def aligned_well(table: ResultTable) -> pd.Series:
    """1 where the pipeline aligned a sighting by itself, accepted it, and is right; else 0."""
    accepted = values(ALIGNMENT_STAGE, "accepted")(table)
    off_m, off_deg = (
        values(ALIGNMENT_STAGE, f"after_{what}")(table).reindex(accepted.index)
        for what in ("translation_m", "rotation_deg")
    )
    return ((accepted > 0) & is_good_pose(off_m, off_deg)).astype(float)


def refined_well(table: ResultTable) -> pd.Series:
    """1 where a refinement was accepted and is good, else 0."""
    return (_accepted(table) & _is_good(table)).astype(float)


def refined_wrongly(table: ResultTable) -> pd.Series:
    """1 where a refinement was accepted and is not good, else 0."""
    return (_accepted(table) & ~_is_good(table)).astype(float)


def _accepted(table: ResultTable) -> pd.Series:
    """Whether each trial was accepted; a table that does not state it counts all as accepted."""
    trials = table.trials()
    return trials.get("accepted", pd.Series(1.0, trials.index)) > 0


def _is_good(table: ResultTable) -> pd.Series:
    off_m, off_deg = (refined(f"after_{what}")(table) for what in ("translation_m", "rotation_deg"))
    return pd.Series(is_good_pose(off_m, off_deg), off_m.index)


def _beliefs(table: ResultTable, metric: str) -> pd.Series:
    return table.rows("localization", metric).set_index([*SEQUENCE_KEYS, "iteration"])["value"]


def _nothing(keys: list[str]) -> pd.Series:
    empty = pd.MultiIndex.from_arrays([[] for _ in keys], names=keys)
    return pd.Series([], index=empty, dtype=np.float64)
