"""What a sweep reads off at each point: shares and medians, with their intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from evaluation.judge.summary import within_5cm_2deg
from evaluation.measure.plans.dials import Point
from evaluation.measure.plans.sweep import SweepPlan
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.measure import measure
from evaluation.measure.work.unit import UnitStore
from evaluation.table.intervals import Rate, median_interval, rate_within, wilson
from evaluation.table.rows import CLOCK_STAGES, ResultTable

BOOTSTRAP_SEED = 0
"""The same table always gets the same intervals."""


@dataclass(frozen=True)
class Reading:
    """A value with its 95 % interval, and how many sequences or trials it is made of."""

    value: float
    low: float
    high: float
    count: int


@dataclass(frozen=True)
class Quantity:
    """One curve of a sweep.

    Attributes:
        name: In files.
        title: For people.
        short: The same for the head of a narrow column.
        unit: "%" for a share of 1, or that of the value.
        counted: What is counted: "sequences" or "trials".
        read: The reading of one point's rows.
    """

    name: str
    title: str
    short: str
    unit: str
    counted: str
    read: Callable[[ResultTable], Reading]


def success_at(table: ResultTable, iteration: int, limit: float) -> Rate:
    """How many sequences are within `limit` at an iteration; none where it was not reached."""
    errors = table.sequences("error_m")
    if len(errors) == 0 or iteration not in errors:
        return wilson(0, 0)
    return rate_within(errors[iteration], limit)


def _of_rate(rate: Rate) -> Reading:
    return Reading(rate.share, rate.low, rate.high, rate.total)


def _median(metric: str) -> Callable[[ResultTable], Reading]:
    def read(table: ResultTable) -> Reading:
        values = table.values("refinement", metric)
        interval = median_interval(values, np.random.default_rng(BOOTSTRAP_SEED))
        return Reading(interval.value, interval.low, interval.high, len(values))

    return read


QUANTITIES = (
    Quantity(
        "within_0_50_m_first", "within 0.5 m after 1 aerial map", "0.5 m, 1 map", "%", "sequences",
        lambda table: _of_rate(success_at(table, 1, 0.50)),
    ),
    Quantity(
        "within_0_25_m_fourth", "within 0.25 m after 4 aerial maps", "0.25 m, 4 maps",
        "%", "sequences",
        lambda table: _of_rate(success_at(table, 4, 0.25)),
    ),
    Quantity(
        "within_5cm_2deg", "refined within 5 cm and 2°", "5 cm and 2°", "%", "trials",
        lambda table: _of_rate(wilson(*within_5cm_2deg(table))),
    ),
    Quantity(
        "refined_translation_m", "refined, median position", "refined", "m", "trials",
        _median("after_translation_m"),
    ),
    Quantity(
        "refined_rotation_deg", "refined, median angle", "refined", "deg", "trials",
        _median("after_rotation_deg"),
    ),
)  # fmt: skip
"""The paper's two success rates (Fig. 11), ours, and the medians of Fig. 13 and 14."""


def readings(table: ResultTable) -> dict[str, Reading]:
    """All quantities of one point, by name."""
    return {quantity.name: quantity.read(table) for quantity in QUANTITIES}


@dataclass(frozen=True)
class Measured:
    """One point of a sweep.

    Attributes:
        point: Where the dials stand.
        table: All rows measured there that do not depend on the machine.
        readings: What they come to.
    """

    point: Point
    table: ResultTable
    readings: dict[str, Reading]


def sweep(plan: SweepPlan, store: UnitStore, crew: Crew) -> list[Measured]:
    """Measure every point that is not measured yet, and read off the quantities.

    Raises:
        InputError: A point cannot be measured.
    """
    points = plan.points()
    units = [plan.units(point) for point in points]
    found = iter(measure([unit for at_point in units for unit in at_point], store, crew))
    measured = []
    for point, at_point in zip(points, units, strict=True):
        table = ResultTable.concat([next(found).table for _ in at_point]).without(CLOCK_STAGES)
        measured.append(Measured(point, table, readings(table.without_controls())))
    return measured
