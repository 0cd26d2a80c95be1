"""The report's tables: text cells, made from the results and the published figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from evaluation.judge.live_summary import LIVE_STAGE, live_summary
from evaluation.judge.readings import success_at
from evaluation.judge.summary import real_time_factor, within_5cm_2deg
from evaluation.setup import published
from evaluation.setup.condition import Condition, short_labels
from evaluation.table.intervals import Rate, quantile, quantiles, wilson
from evaluation.table.rows import ResultTable

MISSING = "-"


@dataclass(frozen=True)
class TextTable:
    """Cells as text; the first column names the row.

    Attributes:
        header: One text per column.
        rows: Tuples as long as the header; what follows a line break in a cell is detail.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def metres(value: float) -> str:
    """Millimetres below 10 cm, metres above; words where failures reach."""
    if np.isnan(value):
        return MISSING
    if np.isinf(value):
        return "failed"
    return f"{1e3 * value:.1f} mm" if abs(value) < 0.1 else f"{value:.2f} m"


def degrees(value: float) -> str:
    if np.isnan(value):
        return MISSING
    return "failed" if np.isinf(value) else f"{value:.2f}°"


def rate(made: Rate) -> str:
    """The share; on a second line the counts and the Wilson interval in percent."""
    if made.total == 0:
        return MISSING
    counts = f"{made.successes} of {made.total}; {100 * made.low:.0f} to {100 * made.high:.0f} %"
    return f"{100 * made.share:.1f} %\n{counts}"


def posed_at(table: ResultTable, iteration: int, limit_m: float, limit_deg: float) -> Rate:
    """How many sequences are within both limits at an iteration; none where nobody looked."""
    off_m, off_deg = table.sequences("error_m"), table.sequences("error_deg")
    if len(table.values("localization", "error_deg")) == 0 or iteration not in off_deg:
        return wilson(0, 0)
    within = (off_m[iteration] <= limit_m) & (off_deg[iteration] <= limit_deg)
    return wilson(int(within.sum()), len(within))


def claims(table: ResultTable, wrong_beyond_m: float = 0.5) -> tuple[Rate, Rate]:
    """At the last iteration: sequences that claim a position, and those claims that are wrong."""
    errors, converged = table.sequences("error_m"), table.sequences("converged")
    if len(errors) == 0:
        return wilson(0, 0), wilson(0, 0)
    last = errors.columns[-1]
    claimed = converged[last].to_numpy(float) > 0
    wrong = claimed & ~(errors[last].to_numpy(float) <= wrong_beyond_m)
    return (
        wilson(int(claimed.sum()), len(claimed)),
        wilson(int(wrong.sum()), int(claimed.sum())),
    )


def comparison_table(table: ResultTable, conditions: Sequence[Condition]) -> TextTable:
    """Every condition beside the paper: what the issue asks of a run, row by row."""
    measured = [table.of(condition).without_controls() for condition in conditions]
    header = ("", "paper (real robots)", *short_labels(conditions))
    rows = [
        (name, paper, *(cell(part) for part in measured)) for name, paper, cell in _COMPARED_ROWS
    ]
    return TextTable(header, tuple(row for row in rows if set(row[2:]) != {MISSING}))


def timing_table(table: ResultTable) -> TextTable:
    """Table I with what was measured here (of one condition)."""
    rows = []
    for stage in published.TABLE_I:
        values = table.values("timing", stage.metric)
        if len(values) == 0 and stage.published_ms is None:
            continue
        paper = MISSING
        if stage.published_ms is not None:
            paper = f"{stage.published_ms:g} ({stage.processor})"
        spread = quantiles(values)
        cells = ("not run", MISSING, MISSING)
        if len(values):
            cells = (
                milliseconds(float(values.mean())),
                milliseconds(spread.median),
                milliseconds(spread.p95),
            )
        rows.append((f"{stage.group}: {stage.title}", paper, *cells, str(len(values))))
    header = (
        "stage",
        "paper, average [ms]",
        "here, average [ms]",
        "here, median [ms]",
        "here, 95 % [ms]",
        "n",
    )
    return TextTable(header, tuple(rows))


def scene_table(table: ResultTable) -> TextTable:
    """The headline numbers scene by scene (of one condition)."""
    rows = []
    for scene in table.scenes():
        part = table.of_scenes([scene])
        trials = part.trials()
        good = wilson(*within_5cm_2deg(part))
        after = trials.get("after_translation_m", pd.Series(dtype=float))
        rows.append(
            (
                scene,
                rate(success_at(part, 1, 0.5)),
                rate(success_at(part, 4, 0.25)),
                metres(quantile(after, 0.5)),
                rate(good),
                metres(quantile(part.values("surface", "error_median_m"), 0.5)),
                _percent(quantile(part.values("surface", "completeness"), 0.5)),
            )
        )
    header = (
        "scene",
        "within 0.5 m at 1",
        "within 0.25 m after 4",
        "refined, median",
        "within 5 cm and 2°",
        "surface, median",
        "completeness",
    )
    return TextTable(header, tuple(rows))


def milliseconds(value: float) -> str:
    if not np.isfinite(value):
        return MISSING
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def _percent(value: float) -> str:
    return f"{100 * value:.0f} %" if np.isfinite(value) else MISSING


def _count(number: int) -> str:
    return str(number) if number else MISSING


def _error_after(table: ResultTable, iteration: int) -> str:
    errors = table.sequences("error_m")
    if len(errors) == 0 or iteration not in errors:
        return MISSING
    return metres(quantile(errors[iteration], 0.5))


def _trial_errors(when: str) -> Callable[[ResultTable], str]:
    """Median translation and angle; the 95th percentiles below."""

    def cell(table: ResultTable) -> str:
        trials = table.trials()
        if f"{when}_translation_m" not in trials:
            return MISSING
        translation = quantiles(trials[f"{when}_translation_m"])
        angle = quantiles(trials[f"{when}_rotation_deg"])
        return (
            f"{metres(translation.median)}, {degrees(angle.median)}\n"
            f"95 %: {metres(translation.p95)}, {degrees(angle.p95)}"
        )

    return cell


def _surface(table: ResultTable) -> str:
    median = quantile(table.values("surface", "error_median_m"), 0.5)
    if np.isnan(median):
        return MISSING
    p90 = quantile(table.values("surface", "error_p90_m"), 0.5)
    return f"{metres(median)}\n90 %: {metres(p90)}"


def _median_of(
    stage: str, metric: str, text: Callable[[float], str]
) -> Callable[[ResultTable], str]:
    return lambda table: text(quantile(table.values(stage, metric), 0.5))


def _real_time(table: ResultTable) -> str:
    factor = real_time_factor(table)
    return MISSING if factor is None else f"{factor:.2f}"


def _claimed(table: ResultTable) -> str:
    return rate(claims(table)[0])


def _wrongly_claimed(table: ResultTable) -> str:
    made = claims(table)[1]
    return rate(made) if made.total else MISSING


def _live_rate(table: ResultTable) -> str:
    live = live_summary(table)
    return MISSING if live is None or live.mav.mbit_s is None else f"{live.mav.mbit_s:.2f} Mbit/s"


def _live_delay(table: ResultTable) -> str:
    delays = table.values(LIVE_STAGE, "aligned_ms")
    return f"{quantile(delays, 0.5):.0f} ms" if len(delays) else MISSING


_COMPARED_ROWS: tuple[tuple[str, str, Callable[[ResultTable], str]], ...] = (
    ("sequences", "41", lambda t: _count(len(t.sequences("error_m")))),
    ("within 0.5 m at iteration 1", "65 %", lambda t: rate(success_at(t, 1, 0.5))),
    ("within 0.25 m after 4", "89 %", lambda t: rate(success_at(t, 4, 0.25))),
    ("within 0.25 m and 3° after 4", MISSING, lambda t: rate(posed_at(t, 4, 0.25, 3.0))),
    ("median error after 4", MISSING, lambda t: _error_after(t, 4)),
    ("median error after 12", MISSING, lambda t: _error_after(t, 12)),
    ("claims a position at the end", MISSING, _claimed),
    ("claims that are off by over 0.5 m", MISSING, _wrongly_claimed),
    ("refinement trials", "67", lambda t: _count(len(t.trials()))),
    ("start of refinement, median", MISSING, _trial_errors("before")),
    ("refined, median", "76 mm, 3.0°", _trial_errors("after")),
    ("the same started at the truth (bound)", MISSING, _trial_errors("from_truth")),
    ("refined within 5 cm and 2°", MISSING, lambda t: rate(wilson(*within_5cm_2deg(t)))),
    (
        "MAV poses, live, RMS after SE3",
        "12 mm",
        _median_of("trajectory", "mav_ate_se3_rmse_m", metres),
    ),
    (
        "ground poses, live, RMS after SE3",
        "38 mm",
        _median_of("trajectory", "ground_ate_se3_rmse_m", metres),
    ),
    ("fused surface, median error", MISSING, _surface),
    ("fused surface, pixels with depth", MISSING, _median_of("surface", "completeness", _percent)),
    ("live: sent by the MAV", MISSING, _live_rate),
    ("live: surface located after its last image, median", MISSING, _live_delay),
    ("recorded over processing seconds", "real time\nwith a GPU", _real_time),
)
