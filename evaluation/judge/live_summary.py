"""Live runs in the few numbers that `summary.json`, screen and report show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from evaluation.setup.checked_json import Count, Number, Part, number
from evaluation.table.intervals import quantile
from evaluation.table.rows import LIVE_STAGE, ResultTable

DEADLINE_MS = 100.0
"""A pose later than this after its image has missed the deadline [ms]."""


class Latency(Part):
    """Time since an image was due [ms]."""

    median: Number
    p95: Number
    worst: Number
    n: Count

    @classmethod
    def of(cls, values_ms: NDArray[np.float64]) -> Latency:
        levels = (0.5, 0.95, 1.0)
        median, p95, worst = (number(quantile(values_ms, level)) for level in levels)
        return cls(median=median, p95=p95, worst=worst, n=len(values_ms))


class LiveRobot(Part):
    """One robot; counts are sums and the rest maxima over the runs.

    Attributes:
        survived: Runs in which its process ran to the end.
        images, dropped: Number of images, and of those dropped since the tracker's buffer was full.
        shed, lost, late: Tracked frames dropped by a full mapper, lost by the radio, or too late
            to be put in order.
        deadlines_missed: Poses later than `DEADLINE_MS`.
        posed_ms, mapped_ms: Latency of the pose, and of the end of the mapper's work on it.
        longest_queue, most_under_way: Images before the tracker, frames before the mapper.
        mbit_s: Data rate to the mapper [Mbit/s].
        processor_share: Share of one core.
        peak_memory_mib: Memory of its process [MiB].
    """

    survived: Count
    images: Count
    dropped: Count
    shed: Count
    lost: Count
    late: Count
    deadlines_missed: Count
    posed_ms: Latency
    mapped_ms: Latency
    longest_queue: Count
    most_under_way: Count
    mbit_s: Number
    processor_share: Number
    peak_memory_mib: Number


class LiveSummary(Part):
    """The live runs, `runs` in number.

    Attributes:
        aligned_ms: Time from a surface's last image to its place in the ground map.
        mapper_processor_share: Share of one core.
        peak_memory_mib: Memory of all processes together [MiB].
    """

    runs: Count
    mav: LiveRobot
    ground: LiveRobot
    aligned_ms: Latency
    mapper_processor_share: Number
    peak_memory_mib: Number


def live_summary(table: ResultTable) -> LiveSummary | None:
    """Sum up the runs of a table that were live; None where none was."""
    runs = len(table.values(LIVE_STAGE, "rate"))
    if runs == 0:
        return None
    processes = ("mav", "ground", "mapper")
    memory = [table.values(LIVE_STAGE, f"{name}_peak_memory_mib") for name in processes]
    return LiveSummary(
        runs=runs,
        mav=_robot(table, "mav"),
        ground=_robot(table, "ground"),
        aligned_ms=Latency.of(table.values(LIVE_STAGE, "aligned_ms")),
        mapper_processor_share=_most(table, "mapper_processor_share"),
        peak_memory_mib=float(sum(values.max() for values in memory if len(values))),
    )


def _robot(table: ResultTable, name: str) -> LiveRobot:
    def total(metric: str) -> int:
        return int(table.values(LIVE_STAGE, f"{name}_{metric}").sum())

    def most(metric: str) -> int:
        return int(_most(table, f"{name}_{metric}") or 0)

    posed_ms = table.values(LIVE_STAGE, f"{name}_posed_ms")
    recorded_s = float(table.values(LIVE_STAGE, "recorded_s").sum())
    return LiveRobot(
        survived=total("survived"),
        images=total("images"),
        dropped=total("dropped"),
        shed=total("shed"),
        lost=total("lost"),
        late=total("late"),
        deadlines_missed=int((posed_ms > DEADLINE_MS).sum()),
        posed_ms=Latency.of(posed_ms),
        mapped_ms=Latency.of(table.values(LIVE_STAGE, f"{name}_mapped_ms")),
        longest_queue=most("longest_queue"),
        most_under_way=most("most_under_way"),
        mbit_s=8e-6 * total("sent_bytes") / recorded_s if recorded_s > 0 else None,
        processor_share=_most(table, f"{name}_processor_share"),
        peak_memory_mib=_most(table, f"{name}_peak_memory_mib"),
    )


def _most(table: ResultTable, metric: str) -> float | None:
    values = table.values(LIVE_STAGE, metric)
    return float(values.max()) if len(values) else None
