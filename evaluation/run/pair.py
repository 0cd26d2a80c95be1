"""Two robots' recordings from anywhere through the whole pipeline, with no truth between them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from airground.augmentation import AugmentedMap
from airground.core.belief import Alignment
from airground.core.cloud import Source
from airground.core.events import Aligned, BeliefUpdated, SurfaceCast
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.io.ply import write_ply
from airground.io.robot_recording import Pair
from airground.io.tum import write_tum
from evaluation.run.alone import error_against, of_pose_frame
from evaluation.run.driver import drive, pipeline_for
from evaluation.run.onlooker import Onlooker, Seen
from evaluation.run.tracking import TrackingHere, TrackingTask, localizer_rng
from evaluation.setup.checked_json import number
from evaluation.setup.setups import Setup
from evaluation.setup.text import metres, percent, seconds
from evaluation.table.tracked_share import tracked_share_of
from evaluation.table.tracking_log import Tracked
from evaluation.table.true_camera import true_camera

ROBOTS = {Source.MAV: "mav", Source.GROUND: "ground"}


@dataclass(eq=False)
class PairEvents:
    """An onlooker that keeps what a run without truth reports.

    Attributes:
        surfaces: Number of aerial surfaces.
        located: Number of aerial surfaces after which a position was claimed.
        alignments: Every refinement, in order of time.
    """

    surfaces: int = 0
    located: int = 0
    alignments: list[Alignment] = field(default_factory=list)

    def see(self, seen: Seen) -> None:
        """Count one event."""
        match seen.event:
            case SurfaceCast():
                self.surfaces += 1
            case BeliefUpdated(belief=belief):
                self.located += belief.converged
            case Aligned(alignment=alignment):
                self.alignments.append(alignment)

    def accepted(self) -> Trajectory | None:
        """`T_ground_mav` of the accepted alignments, by the stamps of their surfaces."""
        accepted = [one for one in self.alignments if one.accepted]
        if not accepted:
            return None
        poses = [alignment.T_ground_mav for alignment in accepted]
        return Trajectory.from_poses([alignment.stamp_ns for alignment in accepted], poses)


@dataclass(frozen=True, eq=False)
class PairResult:
    """What a run over two recordings of a user's own leaves.

    Attributes:
        tracked: Answers of the front ends, by robot ("mav", "ground").
        augmented: The augmented map.
        events: Surfaces, claims and alignments.
    """

    tracked: dict[str, Tracked]
    augmented: AugmentedMap
    events: PairEvents


def run_pair(pair: Pair, setup: Setup, seed: int, onlookers: Sequence[Onlooker] = ()) -> PairResult:
    """Run the pipeline of Figure 4 from the first message to the last.

    A recording of ours that was exported and is read as a pair gives the same result as itself.

    Args:
        pair: Measurements of both robots.
        setup: Settings of the pipeline.
        seed: Seed of all random numbers.
        onlookers: Consumers of every event.

    Raises:
        InputError: The heading is to be known, but a robot has no magnetometer.
    """
    _check_heading(pair, setup)
    tracking = TrackingHere(TrackingTask(pair, None, setup, seed))
    pipeline = pipeline_for(pair, setup, localizer_rng(seed, flight=0))
    events = PairEvents()
    driven = drive(pair, tracking, pipeline, setup, [events, *onlookers])
    return PairResult(driven.tracked, pipeline.augmented_map(), events)


def write_pair(folder: Path, pair: Pair, setup: Setup, result: PairResult) -> dict[str, Any]:
    """Write the map, the trajectories and a summary; returns the summary.

    `mav.tum` and `ground.tum` are as believed at the end, `*_live.tum` as first said, of the
    frame whose truth each publisher states; `T_ground_mav.tum` has the accepted alignments.
    """
    augmented = result.augmented
    write_ply(folder / "augmented_map.ply", augmented.cloud_ground, augmented.sources)
    events = result.events
    accepted = events.accepted()
    if accepted is not None:
        write_tum(folder / "T_ground_mav.tum", accepted)
    summary = {
        "schema": "airground-pair",
        "version": 1,
        "preset": setup.config.preset,
        "replaced": setup.given.describe(),
        "aerial_surfaces": events.surfaces,
        "located": events.located,
        "alignments": len(events.alignments),
        "accepted": 0 if accepted is None else len(accepted),
        "map_points": {
            name: int((augmented.sources == robot).sum()) for robot, name in ROBOTS.items()
        },
        "robots": {
            name: _robot(folder, pair, robot, result.tracked[name])
            for robot, name in ROBOTS.items()
        },
    }
    text = json.dumps(summary, indent=2) + "\n"
    (folder / "summary.json").write_text(text, encoding="utf-8")
    return summary


def print_pair(summary: dict[str, Any], console: Console | None = None) -> None:
    """Print the summary as a short table."""
    shown = Table(
        title=f"both robots, preset {summary['preset']}",
        caption=summary["replaced"] or None,
        title_justify="left",
        caption_justify="left",
    )
    shown.add_column("")
    shown.add_column("here", justify="right", style="bold")
    shown.add_row("aerial surfaces", str(summary["aerial_surfaces"]))
    shown.add_row("located after", str(summary["located"]))
    shown.add_row("alignments accepted", f"{summary['accepted']} of {summary['alignments']}")
    for name, robot in summary["robots"].items():
        shown.add_row(f"{name}: tracked", percent(robot["tracked_fraction"]))
        shown.add_row(f"{name}: first pose after", seconds(robot["first_pose_s"]))
        error = robot["error"]["final"]
        for title, key in (("RMS after SE3", "ate_se3_rmse_m"), ("over 1 m", "rpe_1m_rmse_m")):
            rms = "truth unknown" if error is None else metres(error[key])
            shown.add_row(f"{name}: {title}", rms)
    (console or Console()).print(shown)


def _check_heading(pair: Pair, setup: Setup) -> None:
    if setup.config.localization.heading == "search":
        return
    for recording in (pair.mav, pair.ground):
        if recording.magnetic is None:
            raise InputError(
                f"{recording.path}: has no magnetometer (mag0), so that the heading is unknown; "
                "give --heading search"
            )


def _robot(folder: Path, pair: Pair, robot: Source, tracked: Tracked) -> dict[str, Any]:
    """What is said of one robot; its trajectories are written along the way."""
    recording, name = pair.of(robot), ROBOTS[robot]
    true_pose = true_camera(recording)
    live_poses = tracked.front_end.live_poses()
    live = None
    if live_poses:
        live = Trajectory.from_poses([t for t, _ in live_poses], [T for _, T in live_poses])
    for file, path in ((name, tracked.final), (f"{name}_live", live)):
        if path is not None:
            write_tum(folder / f"{file}.tum", of_pose_frame(path, recording.T_pose_camera))
    answers = tracked.front_end.answers
    share = tracked_share_of(recording, answers, true_pose)
    return {
        "layout": recording.layout,
        "pose_frame": recording.pose_frame,
        "recorded_s": recording.duration_s,
        "images": len(answers),
        "tracked_fraction": share.fraction,
        "first_pose_s": number(share.first_pose_s),
        "frame_ms_median": float(np.median(tracked.front_end.durations_ms)),
        "error": {
            "final": error_against(true_pose, tracked.final),
            "live": error_against(true_pose, live),
        },
    }
