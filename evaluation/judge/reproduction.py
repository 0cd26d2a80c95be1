"""Which of the paper's figures come out: each published number beside ours, with a verdict."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from evaluation.judge import samples
from evaluation.judge.metrics import METRICS, Metric
from evaluation.judge.readings import Reading, rate_of, read
from evaluation.judge.samples import Take
from evaluation.measure.baselines.measure import STAGE as BASELINE_STAGE
from evaluation.setup.checked_json import Count, Number, Part, number
from evaluation.setup.published import TABLE_I
from evaluation.setup.text import formatted, percent
from evaluation.table.intervals import quantile, with_failures
from evaluation.table.limits import FIRST_MAP, FOURTH_MAP, LOCATED_M
from evaluation.table.rows import ResultTable

Verdict = Literal["reproduced", "better", "worse", "not measured"]

MOSTLY = 0.5
"""The paper shows one case that succeeds: so must most of ours."""
HARDLY = 0.05
"""The paper shows one case without any correct match: of ours one in twenty may have them."""


@dataclass(frozen=True)
class PublishedFigure:
    """One statement of the paper, and how ours is compared with it.

    Attributes:
        key: Name in `summary.json`.
        figure: Its place in the paper.
        title: What it is about.
        said: The paper's value, or its words where it has no number.
        range: What the interval of ours is.
        outdoors: Whether it is about the outdoor dataset; the others are about those indoors.
        read: Finds ours in a table of one condition.
        text: A value of ours for readers.
        published: The paper's number; None where it has words only.
        better: Which direction is better, for numbers.
        holds: Whether ours agrees with words; unused for numbers.
    """

    key: str
    figure: str
    title: str
    said: str
    range: str
    read: Callable[[ResultTable], Reading]
    text: Callable[[float], str]
    published: float | None = None
    better: Literal["lower", "higher"] = "lower"
    outdoors: bool = False
    holds: Callable[[float], bool] = bool

    def reading(self, table: ResultTable) -> Reading:
        """Ours, in a table of one condition."""
        return self.read(table.outdoors() if self.outdoors else table.indoors())

    def verdict(self, found: Reading) -> Verdict:
        """Numbers: whether our interval holds the paper's. Words: whether ours agrees."""
        if found.count == 0 or math.isnan(found.value):
            return "not measured"
        if self.published is None:
            return "reproduced" if self.holds(found.value) else "worse"
        if found.low <= self.published <= found.high:
            return "reproduced"
        return "better" if (found.value < self.published) == (self.better == "lower") else "worse"


def _of_metric(name: str, key: str, figure: str) -> PublishedFigure:
    metric = METRICS[name]
    assert metric.published is not None
    return PublishedFigure(
        key, figure, metric.title, metric.paper,
        "95 % (Wilson)" if metric.share else "95 % of the median (bootstrap)",
        lambda table: read(metric, table), metric.text, metric.published.value, metric.better,
    )  # fmt: skip


def _of_one_run(name: str, key: str, figure: str, title: str) -> PublishedFigure:
    """The paper shows one run: ours is compared by its median and range over the flights."""
    metric = METRICS[name]
    assert metric.published is not None
    return PublishedFigure(
        key, figure, title, f"{metric.paper}, one run", "smallest and largest flight",
        lambda table: _over_runs(metric, table), metric.text, metric.published.value,
    )  # fmt: skip


def _over_runs(metric: Metric, table: ResultTable) -> Reading:
    values = with_failures(metric.take(table))
    low, middle, high = (quantile(values, q) for q in (0.0, 0.5, 1.0))
    return Reading(middle, low, high, len(values))


def _share(take: Take) -> Callable[[ResultTable], Reading]:
    def found(table: ResultTable) -> Reading:
        rate = rate_of(take, table)
        return Reading(rate.share, rate.low, rate.high, rate.total)

    return found


def _shrinking(table: ResultTable) -> Reading:
    """Spread after the fourth map over that after the first, of each sequence: the quartiles."""
    first, fourth = (
        samples.localization("spread_m", iteration)(table) for iteration in (FIRST_MAP, FOURTH_MAP)
    )
    ratios = (fourth / first).dropna().to_numpy(np.float64)
    low, middle, high = (quantile(ratios, q) for q in (0.25, 0.5, 0.75))
    return Reading(middle, low, high, len(ratios))


def _slowest_stage(table: ResultTable) -> Reading:
    """Median times of Table I's stages over the published ones: the largest."""
    ratios = []
    for stage in TABLE_I:
        taken = table.values("timing", stage.metric)
        if stage.published_ms is not None and len(taken):
            ratios.append(float(np.median(taken)) / stage.published_ms)
    if not ratios:
        return Reading(math.nan, math.nan, math.nan, 0)
    return Reading(max(ratios), max(ratios), max(ratios), len(ratios))


def _matched(table: ResultTable) -> Reading:
    """How often ASIFT claims a pose, and it is right."""
    rows = table.frame[table.frame["stage"] == BASELINE_STAGE]
    keys = ["scene", "seed", "flight", "trial"]
    wide = rows.pivot(index=keys, columns="metric", values="value")
    if "asift_claimed" not in wide:
        return _share(lambda _: wide.iloc[:0].sum(axis=1))(table)
    wide = wide.dropna(subset="asift_claimed")  # other baselines' rows, as of one not installed
    right = (wide["asift_claimed"] > 0) & (wide["asift_horizontal_m"] <= LOCATED_M)
    return _share(lambda _: right.astype(float))(table)


def _ratio(value: float) -> str:
    return formatted(value, "{:.2f} x")


FIGURES = (
    PublishedFigure(
        "fig03_asift_indoors", "Fig. 3", "image pairs located by ASIFT, indoors",
        "few correct matches, on planar faces; one pair", "95 % (Wilson)", _matched, percent,
        holds=lambda value: value > 0,
    ),
    PublishedFigure(
        "fig03_asift_outdoors", "Fig. 3", "image pairs located by ASIFT, outdoors",
        "no correct match; one pair", "95 % (Wilson)", _matched, percent, outdoors=True,
        holds=lambda value: value <= HARDLY,
    ),
    _of_one_run("mav_trajectory", "fig09_mav", "Fig. 9", "SLAM on the MAV, RMS error"),
    _of_one_run("ground_trajectory", "fig10_ground", "Fig. 10", "SLAM on the ground robot"),
    _of_metric("within_50cm_1", "fig11_within_50cm_1", "Fig. 11"),
    _of_metric("within_25cm_4", "fig11_within_25cm_4", "Fig. 11"),
    PublishedFigure(
        "fig12_spread_ratio", "Fig. 12", "particles' spread, map 4 over map 1",
        "decreases with the error", "quartiles over the sequences", _shrinking, _ratio,
        holds=lambda value: value < 1,
    ),
    _of_metric("refined_translation", "fig13_refined_m", "Fig. 13"),
    _of_metric("refined_rotation", "fig14_refined_deg", "Fig. 14"),
    PublishedFigure(
        "fig15_outdoors", "Fig. 15", "sequences located after 4 maps, outdoors",
        "correct alignment of one map; no truth", "95 % (Wilson)",
        _share(samples.located(FOURTH_MAP, LOCATED_M)), percent, outdoors=True,
        holds=lambda value: value >= MOSTLY,
    ),
    PublishedFigure(
        "table1_slowest", "Table I", "slowest stage over its published time",
        "8 cores and a GPU", "none: one stage", _slowest_stage, _ratio, 1.0,
    ),
)  # fmt: skip
"""In the paper's order. Fig. 9 to 15 as far as its text gives their values."""


class Reproduced(Part):
    """One published figure in `summary.json`."""

    published: Number
    said: str
    value: Number
    low: Number
    high: Number
    n: Count
    verdict: Verdict


def reproduction_summary(table: ResultTable) -> dict[str, Reproduced]:
    """Every published figure by its key (of one condition)."""
    made = {}
    for figure in FIGURES:
        found = figure.reading(table)
        made[figure.key] = Reproduced(
            published=figure.published,
            said=figure.said,
            value=number(found.value),
            low=number(found.low),
            high=number(found.high),
            n=found.count,
            verdict=figure.verdict(found),
        )
    return made
