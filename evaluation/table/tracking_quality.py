"""How well one robot was tracked: errors of live and final poses, gaps, consistency."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.slam.front_end import TrackedPose
from evaluation.table.chi_squared import chi2_quantile
from evaluation.table.row_writer import RowWriter
from evaluation.table.tracked_share import first_motion_ns, tracked_share
from evaluation.table.tracking_log import FrontEndLog, Tracked
from evaluation.table.trajectory_error import MIN_POSES, aligned_errors, trajectory_error

STAGE = "trajectory"
ERROR_STAGE = "trajectory_error"
SLAM_STAGE = {"mav": "mono_slam", "ground": "rgbd_slam"}
DRAWN_EVERY_NS = 100_000_000
"""Errors over time are kept this far apart."""
BEGINNING_NS = 1_000_000_000
"""Poses of this time from the first one on say where a map begins."""


def add_tracking(out: RowWriter, tracked: Tracked, true_pose: Callable[[int], SE3]) -> None:
    """Write all that is measured of a robot's poses (Fig. 9, 10).
    A robot that was never tracked has errors without a number, which count as failures."""
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


@dataclass(frozen=True)
class Consistency:
    """Normalized estimation error squared (NEES) of one part of the pose.

    Attributes:
        nees: Mean over the images, divided by the degrees of freedom: 1 where the covariance
            is right, above 1 where the front end is overconfident. NaN where none was reported.
        within_95: Share of the images whose error lies in the 95 % region; 0.95 is right.
    """

    nees: float
    within_95: float


def consistency(
    answers: Sequence[TrackedPose], true_pose: Callable[[int], SE3]
) -> tuple[Consistency, Consistency]:
    """Consistency of the live position (3 degrees of freedom) and of the live pose (6). A map is
    free in its origin and heading only, where it begins, so the truth is aligned by those four over
    its first second: drift, scale error and tilt count as errors. Images without a usable
    covariance are left out."""
    known = [
        (answer.stamp_ns, answer.T_map_camera, true_pose(answer.stamp_ns), answer.covariance)
        for answer in answers
        if answer.T_map_camera is not None and answer.covariance is not None
    ]
    known = [entry for entry in known if _usable(entry[3])]
    if len(known) < MIN_POSES:
        nothing = Consistency(float("nan"), float("nan"))
        return nothing, nothing
    stamps, estimates, truths, covariances = zip(*known, strict=True)
    first = int(np.searchsorted(stamps, stamps[0] + BEGINNING_NS))
    T_map_world = level_alignment(estimates[:first], truths[:first])
    errors = np.array([_error(e, T_map_world @ t) for e, t in zip(estimates, truths, strict=True)])
    covariance = np.array(covariances)
    return _normalized(errors[:, :3], covariance[:, :3, :3]), _normalized(errors, covariance)


def level_alignment(estimates: Sequence[SE3], truths: Sequence[SE3]) -> SE3:
    """`T_map_world` by shift and heading alone: the mean ones of these poses."""
    turns = np.array(
        [here.rotation @ there.rotation.T for here, there in zip(estimates, truths, strict=True)]
    )
    heading = np.arctan2(
        (turns[:, 1, 0] - turns[:, 0, 1]).sum(), (turns[:, 0, 0] + turns[:, 1, 1]).sum()
    )
    turn = SE3.from_heading(float(heading))
    here = np.mean([pose.translation for pose in estimates], axis=0)
    there = np.mean([pose.translation for pose in truths], axis=0)
    return SE3.from_heading(float(heading), here - turn @ there)


def _usable(covariance: NDArray[np.float64]) -> bool:
    """Whether a covariance can be inverted."""
    return bool(np.isfinite(covariance).all() and np.linalg.eigvalsh(covariance)[0] > 0)


def _error(estimate: SE3, true: SE3) -> NDArray[np.float64]:
    """(6,) position error, then rotation vector of estimate times inverse truth."""
    turn = SE3((estimate.rotation @ true.rotation.T), np.zeros(3))
    return np.concatenate([estimate.translation - true.translation, turn.rotation_vector()])


def _normalized(errors: NDArray[np.float64], covariances: NDArray[np.float64]) -> Consistency:
    freedom = errors.shape[1]
    solved = np.linalg.solve(covariances, errors[:, :, None])[:, :, 0]
    nees = np.einsum("ij,ij->i", errors, solved)
    inside = nees <= chi2_quantile(0.95, freedom)
    return Consistency(float(nees.mean() / freedom), float(inside.mean()))
