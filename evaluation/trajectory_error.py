"""Absolute trajectory error, by evo, with the alignment in the name of every number."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
from evo.core import metrics
from evo.core.trajectory import PoseTrajectory3D

from airground.core.se3 import SE3


@dataclass(frozen=True)
class TrajectoryError:
    """How far a trajectory is off (Fig. 9, 10).

    Attributes:
        se3_rmse_m: RMS position error after SE3 alignment [m].
        sim3_rmse_m: RMS position error after Sim3 alignment [m].
        scale_error: Scale of the Sim3 alignment minus one: above zero, the estimate is small.
        path_m: Length of the true path [m].
    """

    se3_rmse_m: float
    sim3_rmse_m: float
    scale_error: float
    path_m: float


def trajectory_error(
    poses: list[tuple[int, SE3]], true_pose: Callable[[int], SE3]
) -> TrajectoryError:
    """Compare tracked poses with the truth at the same stamps [ns]."""
    reference = _evo([(stamp, true_pose(stamp)) for stamp, _ in poses])
    se3, sim3 = _evo(poses), _evo(poses)
    se3.align(deepcopy(reference))
    _, _, scale = sim3.align(deepcopy(reference), correct_scale=True)
    return TrajectoryError(
        _rmse(reference, se3), _rmse(reference, sim3), float(scale) - 1.0, reference.path_length
    )


def _evo(poses: list[tuple[int, SE3]]) -> PoseTrajectory3D:
    return PoseTrajectory3D(
        positions_xyz=np.array([pose.translation for _, pose in poses]),
        orientations_quat_wxyz=np.array([np.roll(p.quaternion_xyzw(), 1) for _, p in poses]),
        timestamps=np.array([stamp for stamp, _ in poses]) / 1e9,
    )


def _rmse(reference: PoseTrajectory3D, estimate: PoseTrajectory3D) -> float:
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((reference, estimate))
    return float(error.get_statistic(metrics.StatisticsType.rmse))
