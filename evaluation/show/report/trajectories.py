"""The report's figures and table of the robots' own poses (Fig. 9, 10)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from evaluation.judge.poses import POSE_METRICS, ROBOTS, PoseMetric, read_poses
from evaluation.setup import published
from evaluation.setup.condition import Condition, short_labels
from evaluation.setup.text import MISSING, TextTable
from evaluation.show.figures.fig09_10_trajectory_error import ErrorOverTime, trajectory_error_figure
from evaluation.show.figures.style import ReportFigure
from evaluation.table.intervals import with_failures
from evaluation.table.rows import ResultTable

RUN_KEYS = ["scene", "seed", "flight"]


def trajectory_figures(
    table: ResultTable, conditions: Sequence[Condition]
) -> Iterator[ReportFigure]:
    """Fig. 9 and 10: of the first condition the median run and the worst, of others with poses of
    their own the median run; unscored scenes are left out."""
    for number, robot, paper in (
        (9, "mav", published.MAV_RMSE_M),
        (10, "ground", published.GROUND_RMSE_M),
    ):
        primary = table.of(conditions[0]).scored()
        runs = _median_and_worst(primary, robot)
        if not runs:
            continue
        others = _beside(table, conditions, robot)
        count = len(primary.values("trajectory", f"{robot}_ate_se3_rmse_m"))
        beside = f" Beside it: {'; '.join(c.label() for c in others)}, median run." * bool(others)
        for condition in others:
            run = _median_and_worst(table.of(condition).scored(), robot)[0]
            runs.append(replace(run, title=f"preset {condition.preset}, {run.title}"))
        yield ReportFigure(
            f"fig{number:02d}_{robot}_error",
            f"Fig. {number}: position error of the {ROBOTS[robot]} over time",
            "Distance of the camera from its true position, after SE3 alignment of the whole "
            "trajectory (rotation and shift, by evo; scale is not corrected). Live: the pose "
            "estimated with each image; final: the pose after the last image. Grey: initializing "
            f"or lost. Median and worst of {count} run(s) by the RMS of the live poses; "
            f"{conditions[0].label()}.{beside} Dashed: the paper's RMS, {100 * paper.value:g} cm "
            f"({paper.source}), real robot.",
            trajectory_error_figure(runs, paper.value),
        )


def _beside(table: ResultTable, conditions: Sequence[Condition], robot: str) -> list[Condition]:
    """Conditions with SLAM whose poses are not those of a condition before."""
    metric = ("trajectory", f"{robot}_ate_se3_rmse_m")
    known = [table.of(conditions[0]).values(*metric).tolist()]
    found = []
    for condition in conditions[1:]:
        values = table.of(condition).values(*metric).tolist()
        if condition.poses == "slam" and values and values not in known:
            known.append(values)
            found.append(condition)
    return found


def trajectory_table(table: ResultTable, conditions: Sequence[Condition]) -> TextTable:
    """Each condition's poses: median over the runs, the worst run below."""
    parts = [table.of(condition).scored() for condition in conditions]
    kept = [
        (label, part)
        for label, part in zip(short_labels(conditions), parts, strict=True)
        if len(part.values("trajectory", "mav_path_m"))
    ]
    rows = []
    for robot, title in ROBOTS.items():
        for metric in POSE_METRICS:
            cells = [_cell(metric, robot, part) for _, part in kept]
            if set(cells) - {MISSING}:
                head = (f"{title}: {metric.title}", metric.alignment, metric.paper(robot))
                rows.append((*head, *cells))
    header = ("", "alignment", "paper (real robots)", *(label for label, _ in kept))
    return TextTable(header, tuple(rows))


def _cell(metric: PoseMetric, robot: str, table: ResultTable) -> str:
    found = read_poses(metric, robot, table)
    if found.count == 0:
        return MISSING
    worst = f"worst of {found.count}: {metric.text(found.worst)}"
    return f"{metric.text(found.median)}\n{worst}"


def _median_and_worst(table: ResultTable, robot: str) -> list[ErrorOverTime]:
    """The run with the median RMS of its live poses, and the worst where there are several."""
    frame = table.rows("trajectory", f"{robot}_ate_se3_rmse_m")
    if len(frame) == 0 or len(table.rows("trajectory_error", f"{robot}_error_m")) == 0:
        return []
    ranked = frame.assign(value=with_failures(frame["value"])).sort_values("value", kind="stable")
    keys = [tuple(row) for row in ranked[RUN_KEYS].itertuples(index=False)]
    median, worst = keys[(len(keys) - 1) // 2], keys[-1]
    runs = {"the run": worst} if len(keys) == 1 else {"median run": median, "worst run": worst}
    return [_over_time(table, robot, key, title) for title, key in runs.items()]


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
