"""The report's headline numbers and tables, as text."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from evaluation.judge.claims import TO_BE_FOUND, localization_claims
from evaluation.judge.live_summary import live_summary
from evaluation.judge.metrics import METRICS, Metric
from evaluation.judge.readings import median, rate, read, real_time_factor, spread
from evaluation.judge.samples import refined
from evaluation.judge.summary import stage_timing
from evaluation.setup import published
from evaluation.setup.condition import Condition, short_labels
from evaluation.setup.text import (
    MISSING,
    TextTable,
    degrees,
    formatted,
    metres,
    milliseconds,
    percent,
)
from evaluation.table.limits import LOCATED_M
from evaluation.table.rows import ResultTable

REAL_TIME = "real time with a GPU"
"""What the paper states of its speed."""
SEQUENCES, TRIALS = f"{published.SEQUENCES.value:g}", f"{published.REFINEMENT_TRIALS.value:g}"
"""The paper's counts."""


FEW = 10
"""Fewer cases are shown as counts: for less than ten the 95 % interval of any share is wider than
a quarter, and a bootstrap of their median is too narrow."""


@dataclass(frozen=True)
class Headline:
    """One of the numbers that a reader looks for first: its value here with number of cases and
    interval, and the paper's."""

    title: str
    value: str
    detail: str
    paper: str


HEADLINES = (
    "within_25cm_4",
    "within_50cm_1",
    "refined_translation",
    "refined_rotation",
    "refined_well",
    "surface_median",
)


def headlines(table: ResultTable) -> list[Headline]:
    """The numbers of one condition (control scenes apart); what was not measured is left out."""
    made = [_headline(METRICS[name], table) for name in HEADLINES]
    factor = real_time_factor(table)
    if np.isfinite(factor):
        oracle = any(condition.poses != "slam" for condition in table.conditions())
        detail = "both robots, no GPU; recordings measured at the same time share the cores"
        detail += "; poses from an oracle, so no SLAM" if oracle else ""
        title = "recorded seconds per second of processing"
        made.append(Headline(title, f"{factor:.2f}", detail, f"paper: {REAL_TIME}"))
    return [headline for headline in made if headline is not None]


def _headline(metric: Metric, table: ResultTable) -> Headline | None:
    made = read(metric, table)
    if made.count == 0:
        return None
    paper = "not given" if metric.published is None else metric.paper
    each = metric.each if made.count == 1 else f"{metric.each}s"
    if metric.share:
        found = rate(metric, table)
        counts = f"{found.successes} of {found.total}"
        interval = f"95 %: {100 * found.low:.0f} to {100 * found.high:.0f} %"
        if found.total < FEW:
            return Headline(metric.title, counts, f"{each}; {interval}", f"paper: {paper}")
        detail = f"{counts} {each}; {interval}"
        return Headline(metric.title, percent(made.value, 0), detail, f"paper: {paper}")
    detail = f"of {made.count} {each} only"
    if made.count >= FEW:
        interval = f"{metric.text(made.low)} to {metric.text(made.high)}"
        detail = f"median of {made.count} {each}; 95 %: {interval}"
    elif made.count > 1:
        detail = f"median {detail}"
    return Headline(metric.title, metric.text(made.value), detail, f"paper: {paper}")


def comparison_table(table: ResultTable, conditions: Sequence[Condition]) -> TextTable:
    """Every condition beside the paper, a row per metric; rows without any value are left out."""
    measured = [table.of(condition).scored() for condition in conditions]
    header = ("", "paper (real robots)", *short_labels(conditions))
    rows = [
        (name, paper, *(cell(part) for part in measured)) for name, paper, cell in _COMPARED_ROWS
    ]
    return TextTable(header, tuple(row for row in rows if set(row[2:]) != {MISSING}))


def timing_table(table: ResultTable) -> TextTable:
    """Table I with what was measured here (of one condition)."""
    rows = []
    for stage in published.TABLE_I:
        here = stage_timing(table, stage.metric)
        if here.n == 0 and stage.published_ms is None:
            continue
        published_ms = stage.published_ms
        paper = MISSING if published_ms is None else f"{published_ms:g} ({stage.processor})"
        mean = milliseconds(here.mean) if here.n else "not run"
        times = (mean, milliseconds(here.median), milliseconds(here.p95))
        rows.append((f"{stage.group}: {stage.title}", paper, *times, str(here.n)))
    here_ms = (f"here, {what} [ms]" for what in ("average", "median", "95 %"))
    return TextTable(("stage", "paper, average [ms]", *here_ms, "n"), tuple(rows))


SCENE_METRICS = (
    "within_50cm_1",
    "within_25cm_4",
    "refined_translation",
    "refined_well",
    "surface_median",
    "completeness",
)


def scene_table(table: ResultTable) -> TextTable:
    """The headline numbers scene by scene (of one condition)."""
    metrics = [METRICS[name] for name in SCENE_METRICS]
    parts = [(scene, table.of_scenes([scene])) for scene in table.scenes()]
    rows = [(scene, *(_cell(metric)(part) for metric in metrics)) for scene, part in parts]
    return TextTable(("scene", *(metric.title for metric in metrics)), tuple(rows))


Cell = Callable[[ResultTable], str]


def _cell(metric: Metric) -> Cell:
    """The share with its interval, or the median."""
    if metric.share:
        return lambda table: rate(metric, table).text()
    return lambda table: metric.text(median(metric, table))


def _row(name: str) -> tuple[str, str, Cell]:
    metric = METRICS[name]
    return metric.title, metric.paper, _cell(metric)


def _count(number: int) -> str:
    return str(number) if number else MISSING


def _trial_errors(when: str) -> Cell:
    """Median translation and angle; the 95th percentiles below."""

    def cell(table: ResultTable) -> str:
        off_m = spread(refined(f"{when}_translation_m"), table)
        if np.isnan(off_m.median):
            return MISSING
        off_deg = spread(refined(f"{when}_rotation_deg"), table)
        return (
            f"{metres(off_m.median)}, {degrees(off_deg.median)}\n"
            f"95 %: {metres(off_m.p95)}, {degrees(off_deg.p95)}"
        )

    return cell


def _surface(table: ResultTable) -> str:
    middle = median(METRICS["surface_median"], table)
    if np.isnan(middle):
        return MISSING
    return f"{metres(middle)}\n90 %: {metres(median(METRICS['surface_p90'], table))}"


def _claims(wrong: bool) -> Cell:
    """How many localizations claim a position, or how many of those claims are wrong."""

    def cell(table: ResultTable) -> str:
        claims = localization_claims(table).get(TO_BE_FOUND)
        if claims is None:
            return MISSING
        return (claims.wrong if wrong else claims.accepted).text()

    return cell


def _live_rate(table: ResultTable) -> str:
    live = live_summary(table)
    return formatted(live.mav.mbit_s if live else None, "{:.2f} Mbit/s")


def _live_delay(table: ResultTable) -> str:
    live = live_summary(table)
    return formatted(live.aligned_ms.median if live else None, "{:.0f} ms")


_COMPARED_ROWS: tuple[tuple[str, str, Cell], ...] = (
    ("sequences", SEQUENCES, lambda t: _count(len(t.sequences("error_m")))),
    *map(_row, ("within_50cm_1", "within_25cm_4", "posed_4", "localization_4")),
    *map(_row, ("localization_12", "aligned_translation", "aligned_well")),
    ("localizations that claim a position", MISSING, _claims(wrong=False)),
    (f"claims that are off by more than {LOCATED_M:g} m", MISSING, _claims(wrong=True)),
    ("refinement trials", TRIALS, lambda t: _count(len(t.trials()))),
    ("start of refinement, median", MISSING, _trial_errors("before")),
    (
        "refined, median",
        f"{METRICS['refined_translation'].paper}, {METRICS['refined_rotation'].paper}",
        _trial_errors("after"),
    ),
    ("the same started at the truth (bound)", MISSING, _trial_errors("from_truth")),
    *map(_row, ("refined_well", "mav_trajectory", "ground_trajectory")),
    ("surface, median error", MISSING, _surface),
    _row("completeness"),
    ("live: sent by the MAV", MISSING, _live_rate),
    ("live: surface located after its last image, median", MISSING, _live_delay),
    (
        "recorded over processing seconds",
        REAL_TIME.replace(" with", "\nwith"),
        lambda t: formatted(real_time_factor(t), "{:.2f}"),
    ),
)
