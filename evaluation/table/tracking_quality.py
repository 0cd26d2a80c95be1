"""How well one robot was tracked: errors of live and final poses, gaps, consistency."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from airground.core.se3 import SE3
from evaluation.table.consistency import consistency
from evaluation.table.row_writer import RowWriter
from evaluation.table.tracked_share import first_motion_ns, tracked_share
from evaluation.table.tracking_log import FrontEndLog, Tracked
from evaluation.table.trajectory_error import aligned_errors, trajectory_error

STAGE = "trajectory"
ERROR_STAGE = "trajectory_error"
SLAM_STAGE = {"mav": "mono_slam", "ground": "rgbd_slam"}
DRAWN_EVERY_NS = 100_000_000
"""Errors over time are kept this far apart."""


def add_tracking(out: RowWriter, tracked: Tracked, true_pose: Callable[[int], SE3]) -> None:
    """Write all that is measured of a robot's poses (Fig. 9, 10).

    A robot that was never tracked has errors without a number, which count as failures.
    """
    robot, front_end = tracked.robot, tracked.front_end
    ways = (("", front_end.live_poses()), ("final_", tracked.final_poses()))
    for prefix, poses in ways:
        error = trajectory_error(poses, true_pose)
        out.add(STAGE, f"{robot}_{prefix}ate_se3_rmse_m", error.se3_rmse_m, "m")
        out.add(STAGE, f"{robot}_{prefix}ate_sim3_rmse_m", error.sim3_rmse_m, "m")
        out.add(STAGE, f"{robot}_{prefix}scale_error", error.scale_error, "")
        if np.isfinite(error.rpe_1m_rmse_m) or np.isnan(error.se3_rmse_m):
            out.add(STAGE, f"{robot}_{prefix}rpe_1m_rmse_m", error.rpe_1m_rmse_m, "m")
        if not prefix:
            out.add(STAGE, f"{robot}_path_m", error.path_m, "m")
        for time_s, value in _over_time(front_end, poses, true_pose):
            out.add(ERROR_STAGE, f"{robot}_{prefix}error_m", value, "m", time_s=time_s)
    _add_share(out, robot, front_end, true_pose)
    _add_consistency(out, robot, front_end, true_pose)
    if tracked.slam:
        for duration in front_end.durations_ms:
            out.add("timing", SLAM_STAGE[robot], duration, "ms")


def _over_time(
    front_end: FrontEndLog, poses: list[tuple[int, SE3]], true_pose: Callable[[int], SE3]
) -> Iterator[tuple[float, float]]:
    """Seconds since the first image and the error then, NaN where there was no pose."""
    errors = aligned_errors(poses, true_pose).tolist()
    error_at = dict(zip((stamp for stamp, _ in poses), errors, strict=True))
    stamps = front_end.stamps_ns()
    _, drawn = np.unique((stamps - stamps[:1]) // DRAWN_EVERY_NS, return_index=True)
    for stamp in stamps[drawn].tolist():
        yield (stamp - int(stamps[0])) * 1e-9, error_at.get(stamp, float("nan"))


def _add_share(
    out: RowWriter, robot: str, front_end: FrontEndLog, true_pose: Callable[[int], SE3]
) -> None:
    stamps = front_end.stamps_ns()
    motion_ns = first_motion_ns(stamps, true_pose) if len(stamps) else 0
    share = tracked_share(front_end.answers, motion_ns)
    out.add(STAGE, f"{robot}_tracked_fraction", share.fraction, "")
    note = "never tracked" if np.isnan(share.first_pose_s) else ""
    out.add(STAGE, f"{robot}_initialized_s", share.first_pose_s, "s", note=note)


def _add_consistency(
    out: RowWriter, robot: str, front_end: FrontEndLog, true_pose: Callable[[int], SE3]
) -> None:
    """Only what the front end reports; an oracle claims nothing."""
    parts = zip(("position", "pose"), consistency(front_end.answers, true_pose), strict=True)
    for name, found in parts:
        if np.isfinite(found.nees):
            out.add(STAGE, f"{robot}_nees_{name}", found.nees, "")
            out.add(STAGE, f"{robot}_within_95_{name}", found.within_95, "")
    scales = [answer.scale for answer in front_end.answers if answer.scale is not None]
    if scales and scales[-1].observable:
        out.add(STAGE, f"{robot}_scale_sigma", scales[-1].sigma, "")
