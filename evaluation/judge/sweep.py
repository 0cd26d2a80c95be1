"""What a sweep reads at each of its points."""

from __future__ import annotations

from dataclasses import dataclass

from evaluation.judge.metrics import METRICS
from evaluation.judge.readings import Reading, read
from evaluation.measure.plans.dials import Point
from evaluation.measure.plans.sweep import SweepPlan
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.measure import measure
from evaluation.measure.work.unit import UnitStore
from evaluation.table.rows import CLOCK_STAGES, ResultTable

SWEPT = {
    "within_0_50_m_first": METRICS["within_50cm_1"],
    "within_0_25_m_fourth": METRICS["within_25cm_4"],
    "within_5cm_2deg": METRICS["refined_well"],
    "refined_translation_m": METRICS["refined_translation"],
    "refined_rotation_deg": METRICS["refined_rotation"],
}
"""What a sweep reads at each point, by its key in `sweep.json`: the paper's two success rates
(Fig. 11), that of the refinement, and the medians of Fig. 13 and 14."""


@dataclass(frozen=True)
class Measured:
    """One point of a sweep: values of the dials, all rows measured there that do not depend on the
    machine, and the readings by the keys of `SWEPT`."""

    point: Point
    table: ResultTable
    readings: dict[str, Reading]


def sweep(plan: SweepPlan, store: UnitStore, crew: Crew) -> list[Measured]:
    """Measure every point that is not measured yet, and read its metrics.

    Raises:
        InputError: A point cannot be measured.
    """
    points = plan.points()
    units = [plan.units(point) for point in points]
    found = iter(measure([unit for at_point in units for unit in at_point], store, crew))
    measured = []
    for point, at_point in zip(points, units, strict=True):
        table = ResultTable.concat([next(found).table for _ in at_point]).without(CLOCK_STAGES)
        read_here = table.scored()
        readings = {key: read(metric, read_here) for key, metric in SWEPT.items()}
        measured.append(Measured(point, table, readings))
    return measured
