"""Recordings of a user's own, of any known layout: one robot alone.

The truth is optional: errors are stated for the images whose true pose is known.
"""

from __future__ import annotations

import json
import logging
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.trajectory import Trajectory
from airground.io.robot_recording import RobotRecording
from airground.io.silence import silence_note
from airground.slam.front_end import FrontEnd
from evaluation.run.tracking import live_path, write_paths
from evaluation.setup.checked_json import number
from evaluation.setup.progress import step
from evaluation.setup.text import TextTable, metres, percent, print_table, seconds
from evaluation.table.tracked_share import TruePose, tracked_share_of
from evaluation.table.tracking_log import FrontEndLog, WatchedFrontEnd
from evaluation.table.trajectory_error import trajectory_error

logger = logging.getLogger(__name__)

WELL_KNOWN_SCALE, LIKELY_SCALE = 0.02, 0.5
"""Standard deviation of a scale up to which nothing is said of it, and from which on the poses are
up to scale [share]: half is what the closed form needs to give a unit at all."""


@dataclass(frozen=True, eq=False)
class AloneResult:
    """Outcome of one front end over one robot's recording.

    Attributes:
        log: Answers to all images, in order of time.
        final: Final trajectory, camera in map; None without poses.
        finish_ms: Time taken after the last image [ms].
    """

    log: FrontEndLog
    final: Trajectory | None
    finish_ms: float


def run_alone(recording: RobotRecording, front_end: FrontEnd[Any]) -> AloneResult:
    """Feed a whole recording to a front end."""
    watched = WatchedFrontEnd(front_end)
    with step("tracking", len(recording.camera_stamps), "images") as running:
        for stamped in recording.messages():
            match stamped.message:
                case ImuSamples() as samples:
                    watched.add_imu(samples)
                case MavImage() | GroundImage() as image:
                    watched.track(image)
                    running.advance()
    started_s = time.perf_counter()
    watched.finish()
    finish_ms = 1e3 * (time.perf_counter() - started_s)
    return AloneResult(watched.log(), watched.trajectory(), finish_ms)


def why_untracked(
    recording: RobotRecording, log: FrontEndLog, final: Trajectory | None = None
) -> str:
    """One line on why no image of a recording was tracked; empty where one was, or where there are
    `final` poses."""
    if not log.answers or log.live_poses() or final is not None:
        return ""
    waiting = log.waiting or "a first pose"
    return (
        f"{recording.path}: none of the {len(log.answers)} images ({recording.duration_s:.1f} s) "
        f"of the {recording.robot.name.lower()} was tracked; the front end still waited for "
        f"{waiting}"
    )


def scale_note(recording: RobotRecording, log: FrontEndLog, final: Trajectory | None) -> str:
    """One line on poses whose scale is not known well; empty where it is, or where depth or a file
    gives it."""
    scales = [answer.scale for answer in log.answers if answer.scale is not None]
    if final is None or not scales or scales[-1].sigma <= WELL_KNOWN_SCALE:
        return ""
    sigma = scales[-1].sigma
    if sigma < LIKELY_SCALE:
        return f"the scale of the poses is known to {sigma:.1%}"
    if recording.calibration.imu is None:
        return "poses are up to scale: there is no IMU"
    return f"poses are up to scale: the front end still waited for {log.waiting}"


def write_alone(
    folder: Path,
    recording: RobotRecording,
    front_end: str,
    result: AloneResult,
    true_pose: TruePose | None,
) -> dict[str, Any]:
    """Write `trajectory.tum`, `trajectory_live.tum` and `summary.json`; returns the summary."""
    durations_ms = np.array(result.log.durations_ms)
    summary = {
        "schema": "airground-alone",
        "version": 1,
        "robot": recording.robot.name.lower(),
        "front_end": front_end,
        **robot_summary(folder, "trajectory", recording, result.log, result.final, true_pose),
        "frame_ms": {
            "mean": float(durations_ms.mean()),
            "median": float(np.median(durations_ms)),
            "p95": float(np.percentile(durations_ms, 95)),
        },
        "finish_ms": result.finish_ms,
        "why_untracked": why_untracked(recording, result.log, result.final) or None,
    }
    write_summary(folder, summary)
    return summary


def print_alone(summary: dict[str, Any]) -> None:
    """Print the summary of one robot as a short table."""
    times = summary["frame_ms"]
    rows = [
        ("images", str(summary["images"])),
        ("tracked, from the first motion on", percent(summary["tracked_fraction"])),
        ("first pose after", seconds(summary["first_pose_s"])),
        ("lost after the first pose", str(summary["lost_images"])),
        ("images with a final pose", str(summary["final_images"])),
        ("time a frame: mean, 95th percentile", f"{times['mean']:.1f}, {times['p95']:.1f} ms"),
    ]
    for name, error in summary["error"].items():
        if error is None:
            unknown = "truth unknown" if summary["tracked_fraction"] else "-"
            rows.append((f"{name} poses, error", unknown))
            continue
        rows += [
            (f"{name} poses, RMS after SE3", metres(error["ate_se3_rmse_m"])),
            (f"{name} poses, RMS after Sim3", metres(error["ate_sim3_rmse_m"])),
            (f"{name} poses, RMS over 1 m of path", metres(error["rpe_1m_rmse_m"])),
            (f"{name} poses, scale error", f"{100 * error['scale_error']:+.2f} %"),
        ]
    title = f"{summary['robot']} alone, front end {summary['front_end']}"
    caption = (
        summary["why_untracked"]
        or summary["scale_note"]
        or ("errors by evo, of the camera's position, after the alignment named")
    )
    print_table(TextTable(("", "here"), tuple(rows)), title, caption, bold=(1,))


def warn_of_silence(*recordings: RobotRecording[Any]) -> None:
    """Log a warning for each robot whose sensors are all silent for a while."""
    for recording in recordings:
        if note := silence_note(recording):
            logger.warning("%s: %s", recording.robot.name.lower(), note)


def robot_summary(
    folder: Path,
    name: str,
    recording: RobotRecording,
    log: FrontEndLog,
    final: Trajectory | None,
    true_pose: TruePose | None,
) -> dict[str, Any]:
    """Write one robot's trajectories; returns its part of the summary."""
    write_paths(folder, name, recording, log, final)
    share = tracked_share_of(recording, log.answers, true_pose)
    return {
        "layout": recording.layout,
        "pose_frame": recording.pose_frame,
        "recorded_s": recording.duration_s,
        "images": len(log.answers),
        "tracked_fraction": share.fraction,
        "first_pose_s": number(share.first_pose_s),
        "lost_images": share.lost_images,
        "final_images": 0 if final is None else len(final),
        "scale_note": scale_note(recording, log, final) or None,
        "silence_note": silence_note(recording) or None,
        "error": {"final": _error(true_pose, final), "live": _error(true_pose, live_path(log))},
    }


def _error(
    true_pose: TruePose | None, cameras: Trajectory | None
) -> dict[str, float | None] | None:
    """Trajectory errors over the images whose true pose is known; None without any."""
    if cameras is None or true_pose is None:
        return None
    true, poses = {}, []
    for index, stamp_ns in enumerate(cameras.stamps_ns.tolist()):
        if (pose := true_pose(stamp_ns)) is not None:
            true[stamp_ns] = pose
            poses.append((stamp_ns, cameras[index]))
    error = trajectory_error(poses, true.__getitem__)
    if not np.isfinite(error.se3_rmse_m):
        return None  # too few poses, or all in one place
    return {
        "poses": len(poses),
        "path_m": error.path_m,
        "ate_se3_rmse_m": error.se3_rmse_m,
        "ate_sim3_rmse_m": error.sim3_rmse_m,
        "scale_error": error.scale_error,
        "rpe_1m_rmse_m": number(error.rpe_1m_rmse_m),
    }


def write_summary(folder: Path, summary: dict[str, Any]) -> None:
    """Write `summary.json`."""
    text = json.dumps(summary, indent=2) + "\n"
    (folder / "summary.json").write_text(text, encoding="utf-8")
