"""Both robots' recordings of a user's own, of any known layout, through the whole pipeline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from airground.augmentation import AugmentedMap
from airground.core.cloud import Source
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.io.ply import write_ply
from airground.io.robot_recording import Pair
from airground.io.tum import write_tum
from evaluation.run.claim_log import CLAIMS, ClaimLog
from evaluation.run.driver import drive, pipeline_for
from evaluation.run.onlooker import Onlooker
from evaluation.run.own_recordings import robot_summary, why_untracked, write_summary
from evaluation.run.pair_events import PairEvents
from evaluation.run.surface_log import SurfaceLog
from evaluation.run.tracking import TrackingHere, TrackingTask, localizer_rng
from evaluation.setup.setups import Setup
from evaluation.setup.text import TextTable, metres, percent, print_table, seconds
from evaluation.table.answer_file import write_answers
from evaluation.table.tracking_log import Tracked
from evaluation.table.true_camera import true_camera


@dataclass(frozen=True, eq=False)
class PairResult:
    """What a run over two recordings leaves; `tracked` has the answers by robot ("mav",
    "ground"), and `claims` what `RunResult` has."""

    tracked: dict[str, Tracked]
    augmented: AugmentedMap
    events: PairEvents
    surfaces: SurfaceLog
    claims: Sequence[tuple[int, SE3]] = ()


def run_pair(pair: Pair, setup: Setup, seed: int, onlookers: Sequence[Onlooker] = ()) -> PairResult:
    """Run the pipeline of Figure 4 from the first message to the last.

    A recording of ours that was exported and is read as a pair gives the same result as itself.

    Raises:
        InputError: The setup takes the heading from magnetometers, and a robot has none; or no
            image of a robot was tracked.
    """
    if setup.config.localization.heading != "search":
        for recording in (pair.mav, pair.ground):
            if recording.magnetic is None:
                raise InputError(
                    f"{recording.path}: has no magnetometer (mag0), so that the heading is "
                    "unknown; give --heading search"
                )
    tracking = TrackingHere(TrackingTask(pair, None, setup, seed))
    pipeline = pipeline_for(pair, setup, localizer_rng(seed, flight=0))
    events, surfaces, claims = PairEvents(), SurfaceLog(pair.mav), ClaimLog()
    driven = drive(pair, tracking, pipeline, setup, [events, surfaces, claims, *onlookers])
    for robot, tracked in driven.tracked.items():
        reason = why_untracked(pair.of(Source[robot.upper()]), tracked.front_end)
        if reason:
            raise InputError(reason)
    claimed = claims.claims(driven.tracked)
    return PairResult(driven.tracked, pipeline.augmented_map(), events, surfaces, claimed)


def write_pair(folder: Path, pair: Pair, setup: Setup, result: PairResult) -> dict[str, Any]:
    """Write the map, the trajectories and `summary.json`; returns the summary.
    Each robot leaves `ROBOT.tum` and `ROBOT_live.tum`; `T_ground_mav.tum` has the accepted
    alignments by the stamps of their surfaces, `claims.tum` what was claimed at each image."""
    augmented, events = result.augmented, result.events
    if result.claims:
        write_answers(folder / CLAIMS, result.claims)
    write_ply(folder / "augmented_map.ply", augmented.cloud_ground, augmented.sources)
    accepted = [alignment for alignment in events.alignments if alignment.accepted]
    if accepted:
        stamps_ns = [alignment.stamp_ns for alignment in accepted]
        poses = [alignment.T_ground_mav for alignment in accepted]
        write_tum(folder / "T_ground_mav.tum", Trajectory.from_poses(stamps_ns, poses))
    robots = {}
    for name, tracked in result.tracked.items():
        recording, log = pair.of(Source[name.upper()]), tracked.front_end
        robots[name] = robot_summary(
            folder, name, recording, log, tracked.final, true_camera(recording)
        )
        robots[name]["frame_ms_median"] = float(np.median(log.durations_ms))
    summary = {
        "schema": "airground-pair",
        "version": 1,
        "preset": setup.config.preset,
        "replaced": setup.given.describe(),
        "aerial_surfaces": events.surfaces,
        "located": events.located,
        "not_located": dict(events.not_located),
        "alignments": len(events.alignments),
        "accepted": len(accepted),
        "refused": dict(events.refused),
        "surface": result.surfaces.summary(),
        "why": events.why(setup.config),
        "map_points": {
            robot.name.lower(): int((augmented.sources == robot).sum()) for robot in Source
        },
        "robots": robots,
    }
    write_summary(folder, summary)
    return summary


def print_pair(summary: dict[str, Any]) -> None:
    """Print the summary of both robots as a short table."""
    title = f"both robots, preset {summary['preset']}"
    caption = "; ".join(filter(None, (summary["replaced"], summary["why"])))
    print_table(pair_table(summary), title, caption, bold=(1,))


def pair_table(summary: dict[str, Any]) -> TextTable:
    """The summary of both robots as text, for the screen and the report."""
    rows = [
        ("aerial surfaces", str(summary["aerial_surfaces"])),
        ("located after", str(summary["located"])),
        *((f"not located, {kind}", str(n)) for kind, n in summary["not_located"].items()),
        ("alignments accepted", f"{summary['accepted']} of {summary['alignments']}"),
        *((f"refused, {kind}", str(n)) for kind, n in summary["refused"].items()),
    ]
    if (surface := summary["surface"]) is not None:
        quantiles = metres(surface["error_median_m"]), metres(surface["error_p90_m"])
        rows += [
            ("surface against measured depth: median, 90 %", ", ".join(quantiles)),
            ("pixels with depth, of those measured", percent(surface["completeness"])),
        ]
    for name, robot in summary["robots"].items():
        error = robot["error"]["final"]
        rows += [
            (f"{name}: tracked", percent(robot["tracked_fraction"])),
            (f"{name}: first pose after", seconds(robot["first_pose_s"])),
        ]
        for label, key in (("RMS after SE3", "ate_se3_rmse_m"), ("over 1 m", "rpe_1m_rmse_m")):
            rms = "truth unknown" if error is None else metres(error[key])
            rows.append((f"{name}: {label}", rms))
    return TextTable(("", "here"), tuple(rows))
