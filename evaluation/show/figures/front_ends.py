"""Position errors over time of several front ends on one robot's recording.

python -m evaluation.show.figures.front_ends RECORDING ground slam open3d opencv --out FILE.png
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from airground.config import Config
from airground.core.cloud import Source
from airground.errors import InputError
from airground.io.open_recording import open_robot
from airground.io.robot_recording import RobotRecording
from airground.slam import front_ends
from airground.slam.front_end import FrontEnd
from evaluation.run.own_recordings import run_alone
from evaluation.show.figures.style import PICTURE_DPI, SERIES, WIDE_IN, styled
from evaluation.table.tracked_share import tracked_share_of
from evaluation.table.trajectory_error import aligned_errors
from evaluation.table.true_camera import true_camera


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


def front_end_error(recording: RobotRecording, name: str, config: Config) -> FrontEndError:
    """Run one front end over a recording with known truth.

    Raises:
        InputError: The recording has no truth, or the front end gave too few poses.
    """
    true_pose = true_camera(recording)
    if true_pose is None:
        raise InputError(f"{recording.path}: no ground truth to compare with")
    given = front_ends.Ingredients(recording.calibration, config, np.random.default_rng(0))
    front_end: FrontEnd[Any]
    if recording.robot == Source.MAV:
        front_end = front_ends.make_front_end(front_ends.MAV, name, given)
    else:
        front_end = front_ends.make_front_end(front_ends.GROUND, name, given)
    result = run_alone(recording, front_end)
    truth = {
        stamp: true
        for stamp, _ in result.log.live_poses()
        if (true := true_pose(stamp)) is not None
    }
    if len(truth) < 3:
        raise InputError(f"{name}: gave {len(truth)} poses with known truth, at least 3 needed")
    known = [(stamp, pose) for stamp, pose in result.log.live_poses() if stamp in truth]
    errors = aligned_errors(known, truth.__getitem__)
    time_s = (np.array(list(truth)) - recording.camera_stamps[0]) * 1e-9
    share = tracked_share_of(recording, result.log.answers, true_pose)
    return FrontEndError(name, time_s, errors, share.fraction)


def main(words: Sequence[str] | None = None) -> None:
    """Draw the errors of the given front ends, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", type=Path)
    parser.add_argument("robot", choices=["mav", "ground"])
    parser.add_argument("front_ends", nargs="+", metavar="FRONT_END")
    parser.add_argument("--out", type=Path, required=True, help="picture to write")
    given = parser.parse_args(words)
    recording = open_robot(given.recording, Source[given.robot.upper()])
    errors = [front_end_error(recording, name, Config()) for name in given.front_ends]
    title = f"{given.recording.resolve().name}, {given.robot}, live poses"
    front_ends_figure(title, errors).savefig(given.out, dpi=PICTURE_DPI)
    for one in errors:
        print(f"{one.name:10} {one.rms_cm:6.2f} cm RMS after SE3   {one.tracked:6.1%} tracked")


if __name__ == "__main__":
    main()
