"""What is measured of the robots' own poses: a literal table, its readings and its summary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from evaluation.judge.metrics import METRICS
from evaluation.setup.checked_json import Number, Part, number
from evaluation.setup.text import MISSING, formatted, metres, percent, seconds
from evaluation.table.intervals import quantile, with_failures
from evaluation.table.rows import ResultTable

ROBOTS = {"mav": "MAV", "ground": "ground robot"}
SE3_ALIGNED, SIM3_ALIGNED = "SE3, scale not corrected", "Sim3, scale corrected"
NONE, START = "none needed", "shift and heading of the first second"


@dataclass(frozen=True)
class PoseMetric:
    """One measure of a robot's poses, one value per recording.

    Attributes:
        name: Its key in `summary.json`, and after the robot's name in the results.
        title: Its name for readers.
        alignment: How the poses were brought onto the true ones.
        unit: "m", "s", "length" (a path in metres), "share" or "ratio".
        worst: Which value is the worst.
    """

    name: str
    title: str
    alignment: str
    unit: Literal["m", "s", "length", "share", "ratio"]
    worst: Literal["largest", "smallest"] = "largest"

    def paper(self, robot: str) -> str:
        if self.name == "ate_se3_rmse_m":
            return METRICS[f"{robot}_trajectory"].paper
        return "7.7 m" if (self.name, robot) == ("path_m", "ground") else MISSING

    def text(self, value: float) -> str:
        match self.unit:
            case "m":
                return metres(value)
            case "s":
                return seconds(value)
            case "length":
                return formatted(value, "{:.1f} m")
            case "share":
                return percent(value, 2)
            case _:
                return formatted(value, "{:.2f}", infinite=MISSING)


POSE_METRICS = (
    PoseMetric("ate_se3_rmse_m", "live, RMS error", SE3_ALIGNED, "m"),
    PoseMetric("ate_sim3_rmse_m", "live, RMS error", SIM3_ALIGNED, "m"),
    PoseMetric("scale_error", "live, scale error (absolute)", SIM3_ALIGNED, "share"),
    PoseMetric("rpe_1m_rmse_m", "live, RMS error over 1 m of path", NONE, "m"),
    PoseMetric("final_ate_se3_rmse_m", "final, RMS error", SE3_ALIGNED, "m"),
    PoseMetric("final_ate_sim3_rmse_m", "final, RMS error", SIM3_ALIGNED, "m"),
    PoseMetric("final_scale_error", "final, scale error (absolute)", SIM3_ALIGNED, "share"),
    PoseMetric("final_rpe_1m_rmse_m", "final, RMS error over 1 m of path", NONE, "m"),
    PoseMetric("scale_sigma", "scale, standard deviation it reports", MISSING, "share"),
    PoseMetric(
        "tracked_fraction", "images tracked, from the first motion on", MISSING, "share", "smallest"
    ),
    PoseMetric("initialized_s", "first pose after", MISSING, "s"),
    PoseMetric("path_m", "true path while tracked", MISSING, "length", "smallest"),
    PoseMetric("nees_position", "position, NEES over 3 (1 is right)", START, "ratio"),
    PoseMetric(
        "within_95_position", "position, inside its 95 % region", START, "share", "smallest"
    ),
    PoseMetric("nees_pose", "pose, NEES over 6 (1 is right)", START, "ratio"),
    PoseMetric("within_95_pose", "pose, inside its 95 % region", START, "share", "smallest"),
)


@dataclass(frozen=True)
class PoseReading:
    """Median and worst over `count` recordings; a failure is infinite, NaN stands for none."""

    median: float
    worst: float
    count: int


def read_poses(metric: PoseMetric, robot: str, table: ResultTable) -> PoseReading:
    """A metric of one robot in a table; scale errors count by their size."""
    values = table.values("trajectory", f"{robot}_{metric.name}")
    if metric.name.endswith("scale_error"):
        values = np.abs(values)
    counted = with_failures(values)
    worst = quantile(counted, 1.0 if metric.worst == "largest" else 0.0)
    return PoseReading(quantile(counted, 0.5), worst, len(counted))


class SlamRobot(Part):
    """Medians over the runs; `ate` and `rpe` are of live poses, `final` of those at the end.

    Scale errors are absolute. `worst` is the largest over the runs, null where one run has no
    trajectory; `nees` is divided by its degrees of freedom, so that 1 is right; `rpe` is over
    all pairs of poses that are 1 m of path apart.
    """

    ate_sim3_rmse_m: Number = None
    ate_se3_rmse_m: Number = None
    scale_error: Number = None
    rpe_1m_rmse_m: Number = None
    final_ate_sim3_rmse_m: Number = None
    final_ate_se3_rmse_m: Number = None
    final_scale_error: Number = None
    final_rpe_1m_rmse_m: Number = None
    worst_ate_se3_rmse_m: Number = None
    worst_final_ate_se3_rmse_m: Number = None
    tracked_fraction: Number = None
    least_tracked_fraction: Number = None
    initialized_s: Number = None
    path_m: Number = None
    scale_sigma: Number = None
    nees_position: Number = None
    within_95_position: Number = None
    nees_pose: Number = None
    within_95_pose: Number = None

    @classmethod
    def of(cls, table: ResultTable, robot: str) -> SlamRobot:
        made = {}
        for metric in POSE_METRICS:
            found = read_poses(metric, robot, table)
            made[metric.name] = number(found.median)
            for extreme in ("worst", "least"):
                if (name := f"{extreme}_{metric.name}") in cls.model_fields:
                    made[name] = number(found.worst)
        return cls(**made)


class Slam(Part):
    mav: SlamRobot
    ground: SlamRobot
