"""Position errors over time of several front ends on one robot's recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from airground.io.robot_recording import RobotRecording
from evaluation.run.own_recordings import AloneResult
from evaluation.show.figures.style import SERIES, WIDE_IN, save_picture, styled
from evaluation.table.tracked_share import TruePose, tracked_share_of
from evaluation.table.trajectory_error import aligned_errors

MIN_POSES = 3
"""Fewer positions determine no alignment."""


@dataclass(frozen=True, eq=False)
class FrontEndError:
    """One front end on the recording.

    Attributes:
        name: Name on the command line.
        time_s: (N,) times of its poses since the first image [s].
        error_m: (N,) position errors after SE3 alignment [m].
        tracked: Share of the images with a pose (`tracked_share`).
    """

    name: str
    time_s: NDArray[np.float64]
    error_m: NDArray[np.float64]
    tracked: float

    @property
    def rms_cm(self) -> float:
        return 100 * float(np.sqrt(np.mean(self.error_m**2)))


@styled
def front_ends_figure(title: str, errors: Sequence[FrontEndError]) -> Figure:
    """One curve per front end, with its RMS error and its share of tracked images."""
    figure = Figure(figsize=(WIDE_IN, 3.2), layout="constrained")
    axes = figure.subplots()
    for colour, one in zip(SERIES, errors, strict=False):
        label = f"{one.name}: {one.rms_cm:.1f} cm RMS, {one.tracked:.0%} tracked"
        axes.plot(one.time_s, 100 * one.error_m, color=colour, linewidth=1.5, label=label)
    axes.set_title(title)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("position error after SE3 alignment [cm]")
    axes.set_ylim(bottom=0)
    axes.grid(axis="y")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure


def front_end_error(
    recording: RobotRecording[Any], name: str, result: AloneResult, true_pose: TruePose
) -> FrontEndError | None:
    """Errors of one front end's live poses; None with fewer than `MIN_POSES` of known truth."""
    poses = result.log.live_poses()
    truth = {stamp: true for stamp, _ in poses if (true := true_pose(stamp)) is not None}
    if len(truth) < MIN_POSES:
        return None
    known = [(stamp, pose) for stamp, pose in poses if stamp in truth]
    errors = aligned_errors(known, truth.__getitem__)
    time_s = (np.array(list(truth)) - recording.camera_stamps[0]) * 1e-9
    share = tracked_share_of(recording, result.log.answers, true_pose)
    return FrontEndError(name, time_s, errors, share.fraction)


def draw_front_ends(
    folder: Path,
    recording: RobotRecording[Any],
    results: Mapping[str, AloneResult],
    true_pose: TruePose | None,
) -> None:
    """Write `front_ends.png` with all front ends whose errors are known, if there are any."""
    if true_pose is None:
        return
    found = [front_end_error(recording, *one, true_pose) for one in results.items()]
    if errors := [error for error in found if error is not None]:
        title = f"{recording.path.resolve().name}, {recording.robot.name.lower()}, live poses"
        save_picture(front_ends_figure(title, errors), folder, "front_ends")
