"""The report's figures and table of the robots' own poses (Fig. 9, 10)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from evaluation.setup import published
from evaluation.setup.condition import Condition, short_labels
from evaluation.show.figures.trajectory_error import ErrorOverTime, trajectory_error_figure
from evaluation.show.gallery.figures import ReportFigure
from evaluation.show.report.tables import MISSING, TextTable, metres
from evaluation.table.intervals import quantile, with_failures
from evaluation.table.rows import ResultTable

RUN_KEYS = ["scene", "seed", "flight"]


def trajectory_figures(table: ResultTable, condition: Condition) -> Iterator[ReportFigure]:
    """Fig. 9 and 10 of one condition: the median run and the worst.

    Args:
        table: Rows of that condition, control scenes apart.
        condition: For the captions.
    """
    for number, robot, name, paper in (
        (9, "mav", "the MAV", published.MAV_RMSE_M),
        (10, "ground", "the ground robot", published.GROUND_RMSE_M),
    ):
        runs = _median_and_worst(table, robot)
        if not runs:
            continue
        count = len(table.values("trajectory", f"{robot}_ate_se3_rmse_m"))
        yield ReportFigure(
            f"fig{number:02d}_{robot}_error",
            f"Fig. {number}: position error of {name} over time",
            "Distance of the camera from where it truly was, after SE3 alignment of the whole "
            "trajectory (rotation and shift, by evo; scale is not corrected). Live: as said with "
            "the image; final: as believed at the end. Grey: initializing or lost. Median and "
            f"worst of {count} run(s) by the RMS of the live poses; {condition.label()}. Dashed: "
            f"the paper's RMS, {100 * paper.value:g} cm ({paper.source}), real robot.",
            trajectory_error_figure(runs, paper.value),
        )


def trajectory_table(table: ResultTable, conditions: Sequence[Condition]) -> TextTable:
    """What each condition's poses are worth: median over the runs, the worst run below."""
    parts = [table.of(condition).without_controls() for condition in conditions]
    kept = [
        (label, part)
        for label, part in zip(short_labels(conditions), parts, strict=True)
        if len(part.values("trajectory", "mav_path_m"))
    ]
    rows = []
    for robot, title in (("mav", "MAV"), ("ground", "ground robot")):
        for name, alignment, paper, metric, text, worst in _MEASURES:
            cells = [_cell(part, f"{robot}_{metric}", text, worst) for _, part in kept]
            if set(cells) - {MISSING}:
                rows.append((f"{title}: {name}", alignment, paper.get(robot, MISSING), *cells))
    header = ("", "alignment", "paper (real robots)", *(label for label, _ in kept))
    return TextTable(header, tuple(rows))


def _cell(
    table: ResultTable,
    metric: str,
    text: Callable[[float], str],
    worst: Callable[[NDArray[np.float64]], float],
) -> str:
    values = table.values("trajectory", metric)
    if len(values) == 0:
        return MISSING
    if metric.endswith("scale_error"):
        values = np.abs(values)
    failed = with_failures(values)
    return f"{text(quantile(failed, 0.5))}\nworst of {len(values)}: {text(worst(failed))}"


def _median_and_worst(table: ResultTable, robot: str) -> list[ErrorOverTime]:
    """The run with the median RMS of its live poses, and the worst where there are several."""
    frame = table.rows("trajectory", f"{robot}_ate_se3_rmse_m")
    if len(frame) == 0 or len(table.rows("trajectory_error", f"{robot}_error_m")) == 0:
        return []
    ranked = frame.assign(value=with_failures(frame["value"])).sort_values("value", kind="stable")
    keys = [tuple(row) for row in ranked[RUN_KEYS].itertuples(index=False)]
    median, worst = keys[(len(keys) - 1) // 2], keys[-1]
    if len(keys) == 1:
        return [_over_time(table, robot, median, "the run")]
    return [
        _over_time(table, robot, median, "median run"),
        _over_time(table, robot, worst, "worst run"),
    ]


def _over_time(table: ResultTable, robot: str, key: tuple, title: str) -> ErrorOverTime:
    scene, seed, flight = key
    series = []
    for metric in (f"{robot}_error_m", f"{robot}_final_error_m"):
        rows = table.rows("trajectory_error", metric)
        mine = (rows["scene"] == scene) & (rows["seed"] == seed) & (rows["flight"] == flight)
        series.append(rows[mine])
    live, final = series
    return ErrorOverTime(
        f"{title} ({scene}, seed {seed}, flight {flight})",
        live["time_s"].to_numpy(np.float64),
        live["value"].to_numpy(np.float64),
        final["value"].to_numpy(np.float64),
    )


def _percent(value: float) -> str:
    return f"{100 * value:.2f} %" if np.isfinite(value) else "failed"


def _seconds(value: float) -> str:
    return f"{value:.1f} s" if np.isfinite(value) else "never"


def _length(value: float) -> str:
    return f"{value:.1f} m"


def _plain(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else MISSING


SE3_ALIGNED, SIM3_ALIGNED = "SE3, scale not corrected", "Sim3, scale corrected"
LEVEL = "shift and heading"

_MEASURES: tuple[tuple[str, str, dict[str, str], str, Callable, Callable], ...] = (
    ("live, RMS error", SE3_ALIGNED, {"mav": "12 mm", "ground": "38 mm"},
     "ate_se3_rmse_m", metres, np.max),
    ("live, RMS error", SIM3_ALIGNED, {}, "ate_sim3_rmse_m", metres, np.max),
    ("live, scale error (absolute)", SIM3_ALIGNED, {}, "scale_error", _percent, np.max),
    ("final, RMS error", SE3_ALIGNED, {}, "final_ate_se3_rmse_m", metres, np.max),
    ("final, RMS error", SIM3_ALIGNED, {}, "final_ate_sim3_rmse_m", metres, np.max),
    ("final, scale error (absolute)", SIM3_ALIGNED, {}, "final_scale_error", _percent, np.max),
    ("scale, standard deviation it reports", MISSING, {}, "scale_sigma", _percent, np.max),
    ("images tracked, from the first motion on", MISSING, {}, "tracked_fraction", _percent, np.min),
    ("first pose after", MISSING, {}, "initialized_s", _seconds, np.max),
    ("true path while tracked", MISSING, {"ground": "7.7 m"}, "path_m", _length, np.min),
    ("position, NEES over 3 (1 is right)", LEVEL, {}, "nees_position", _plain, np.max),
    ("position, inside its 95 % region", LEVEL, {}, "within_95_position", _percent, np.min),
    ("pose, NEES over 6 (1 is right)", LEVEL, {}, "nees_pose", _plain, np.max),
    ("pose, inside its 95 % region", LEVEL, {}, "within_95_pose", _percent, np.min),
)  # fmt: skip
"""Name, alignment, the paper's number by robot, metric, as text, which run is the worst."""
