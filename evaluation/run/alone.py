"""One robot alone through one front end: its trajectory, and how good it was."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io.robot_recording import RobotRecording
from airground.io.tum import write_tum
from airground.slam.front_end import FrontEnd, TrackedPose
from evaluation.setup.checked_json import number
from evaluation.setup.progress import step
from evaluation.setup.text import metres, percent, seconds
from evaluation.table.tracked_share import tracked_share_of
from evaluation.table.trajectory_error import trajectory_error


@dataclass(frozen=True, eq=False)
class AloneResult:
    """What a front end made of one robot's recording.

    Attributes:
        tracked: What it said of each image, in order of time.
        live: The poses as they were given, camera in map; None if there are none.
        final: The poses as they were believed at the end.
        frame_ms: (N,) time taken by each image and the samples before it, without decoding.
        finish_ms: Time taken after the last.
    """

    tracked: list[TrackedPose]
    live: Trajectory | None
    final: Trajectory | None
    frame_ms: NDArray[np.float64]
    finish_ms: float


def run_alone(recording: RobotRecording, front_end: FrontEnd[Any]) -> AloneResult:
    """Feed a whole recording to a front end."""
    tracked: list[TrackedPose] = []
    frame_ms: list[float] = []
    pending_s = 0.0
    with step("tracking", len(recording.camera_stamps), "images") as running:
        for stamped in recording.messages():
            started = time.perf_counter()
            match stamped.message:
                case ImuSamples() as samples:
                    front_end.add_imu(samples)
                    pending_s += time.perf_counter() - started
                case MavImage() | GroundImage() as image:
                    tracked.append(front_end.track(image))
                    frame_ms.append(1e3 * (pending_s + time.perf_counter() - started))
                    pending_s = 0.0
                    running.advance()
    started = time.perf_counter()
    front_end.finish()
    finish_ms = 1e3 * (time.perf_counter() - started)
    live = _live(tracked)
    return AloneResult(tracked, live, front_end.trajectory(), np.array(frame_ms), finish_ms)


def write_alone(
    folder: Path,
    recording: RobotRecording,
    front_end: str,
    result: AloneResult,
    true_pose: Callable[[int], SE3 | None] | None,
) -> dict[str, Any]:
    """Write `trajectory.tum`, `trajectory_live.tum` and `summary.json`; returns the summary.

    The poses are those of `recording.pose_frame`, the frame whose truth the publisher
    states, so that other tools can compare them as they are.
    """
    for name, path in (("trajectory", result.final), ("trajectory_live", result.live)):
        if path is not None:
            write_tum(folder / f"{name}.tum", of_pose_frame(path, recording.T_pose_camera))
    share = tracked_share_of(recording, result.tracked, true_pose)
    summary = {
        "schema": "airground-alone",
        "version": 1,
        "layout": recording.layout,
        "robot": recording.robot.name.lower(),
        "front_end": front_end,
        "pose_frame": recording.pose_frame,
        "recorded_s": recording.duration_s,
        "images": len(result.tracked),
        "tracked_fraction": share.fraction,
        "first_pose_s": number(share.first_pose_s),
        "lost_images": share.lost_images,
        "frame_ms": {
            "mean": float(result.frame_ms.mean()),
            "median": float(np.median(result.frame_ms)),
            "p95": float(np.percentile(result.frame_ms, 95)),
        },
        "finish_ms": result.finish_ms,
        "error": {
            "final": error_against(true_pose, result.final),
            "live": error_against(true_pose, result.live),
        },
    }
    text = json.dumps(summary, indent=2) + "\n"
    (folder / "summary.json").write_text(text, encoding="utf-8")
    return summary


def print_alone(summary: dict[str, Any], console: Console | None = None) -> None:
    """Print the summary as a short table."""
    shown = Table(
        title=f"{summary['robot']} alone, front end {summary['front_end']}",
        caption="errors by evo, of the camera's position, after the alignment named",
        title_justify="left",
        caption_justify="left",
    )
    shown.add_column("")
    shown.add_column("here", justify="right", style="bold")
    times = summary["frame_ms"]
    shown.add_row("images", str(summary["images"]))
    shown.add_row("tracked, from the first motion on", percent(summary["tracked_fraction"]))
    shown.add_row("first pose after", seconds(summary["first_pose_s"]))
    shown.add_row("lost after the first pose", str(summary["lost_images"]))
    shown.add_row(
        "time a frame: mean, 95th percentile", f"{times['mean']:.1f}, {times['p95']:.1f} ms"
    )
    for name in ("final", "live"):
        error = summary["error"][name]
        if error is None:
            shown.add_row(
                f"{name} poses, error", "truth unknown" if summary["tracked_fraction"] else "-"
            )
            continue
        shown.add_row(f"{name} poses, RMS after SE3", metres(error["ate_se3_rmse_m"]))
        shown.add_row(f"{name} poses, RMS after Sim3", metres(error["ate_sim3_rmse_m"]))
        shown.add_row(f"{name} poses, RMS over 1 m of path", metres(error["rpe_1m_rmse_m"]))
        shown.add_row(f"{name} poses, scale error", f"{100 * error['scale_error']:+.2f} %")
    (console or Console()).print(shown)


def _live(tracked: list[TrackedPose]) -> Trajectory | None:
    poses = [(p.stamp_ns, p.T_map_camera) for p in tracked if p.T_map_camera is not None]
    if not poses:
        return None
    stamps, cameras = zip(*poses, strict=True)
    return Trajectory.from_poses(list(stamps), list(cameras))


def of_pose_frame(cameras: Trajectory, T_pose_camera: SE3) -> Trajectory:
    """Poses of the frame whose truth the publisher states, from those of the camera."""
    T_camera_pose = T_pose_camera.inverse()
    poses = [cameras[index] @ T_camera_pose for index in range(len(cameras))]
    return Trajectory.from_poses(cameras.stamps_ns.tolist(), poses)


def error_against(
    true_pose: Callable[[int], SE3 | None] | None, cameras: Trajectory | None
) -> dict[str, float | None] | None:
    """Absolute trajectory error over the images whose true pose is known."""
    if cameras is None or true_pose is None:
        return None
    true = {int(stamp): true_pose(int(stamp)) for stamp in cameras.stamps_ns}
    known = {stamp: pose for stamp, pose in true.items() if pose is not None}
    poses = [
        (int(stamp), cameras[index])
        for index, stamp in enumerate(cameras.stamps_ns)
        if int(stamp) in known
    ]
    error = trajectory_error(poses, lambda stamp: known[stamp])
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
