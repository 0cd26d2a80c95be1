"""Trajectory errors by evo, with the alignment in the name of every absolute one."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
from evo.core import metrics
from evo.core.filters import FilterException
from evo.core.geometry import GeometryException
from evo.core.trajectory import PoseTrajectory3D
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.core.se3 import SE3

MIN_POSES = 3
"""Fewer poses can be brought onto any others."""
RELATIVE_M = 1.0
"""True path between the two poses of a relative error [m]:
`evo_rpe tum TRUE ESTIMATE -d 1 -u m --all_pairs --pairs_from_reference`."""


@dataclass(frozen=True)
class TrajectoryError:
    """How far a trajectory is off (Fig. 9, 10); NaN where it cannot be aligned.

    Attributes:
        se3_rmse_m: RMS position error after SE3 alignment [m].
        sim3_rmse_m: RMS position error after Sim3 alignment [m].
        scale_error: Scale of the Sim3 alignment minus one: above zero, the estimate is small.
        rpe_1m_rmse_m: RMS translation error over all pairs of poses that are `RELATIVE_M` of the
            true path apart, which needs no alignment [m]; NaN for a shorter path.
        path_m: Length of the true path [m].
    """

    se3_rmse_m: float
    sim3_rmse_m: float
    scale_error: float
    rpe_1m_rmse_m: float
    path_m: float


def trajectory_error(
    poses: list[tuple[int, SE3]], true_pose: Callable[[int], SE3]
) -> TrajectoryError:
    """Compare tracked poses with the truth at the same stamps [ns]."""
    if len(poses) < MIN_POSES:
        return TrajectoryError(np.nan, np.nan, np.nan, np.nan, 0.0)
    reference = _evo([(stamp, true_pose(stamp)) for stamp, _ in poses])
    se3 = _evo(poses)
    sim3 = deepcopy(se3)
    relative_m = _relative_rmse(deepcopy(reference), deepcopy(se3))
    path_m = reference.path_length
    try:
        se3.align(deepcopy(reference))
        _, _, scale = sim3.align(deepcopy(reference), correct_scale=True)
    except GeometryException:
        # poses on one point or line can be turned at will
        return TrajectoryError(np.nan, np.nan, np.nan, relative_m, path_m)
    return TrajectoryError(
        _rmse(_errors(reference, se3)),
        _rmse(_errors(reference, sim3)),
        float(scale) - 1.0,
        relative_m,
        path_m,
    )


def aligned_errors(
    poses: list[tuple[int, SE3]], true_pose: Callable[[int], SE3]
) -> NDArray[np.float64]:
    """(N,) position error of each pose after SE3 alignment of all [m]; NaN where impossible."""
    if len(poses) < MIN_POSES:
        return np.full(len(poses), np.nan)
    reference, estimate = _evo([(stamp, true_pose(stamp)) for stamp, _ in poses]), _evo(poses)
    try:
        estimate.align(deepcopy(reference))
    except GeometryException:
        return np.full(len(poses), np.nan)
    return _errors(reference, estimate)


def _evo(poses: list[tuple[int, SE3]]) -> PoseTrajectory3D:
    xyzw = Rotation.from_matrix(np.array([pose.rotation for _, pose in poses])).as_quat()
    return PoseTrajectory3D(
        positions_xyz=np.array([pose.translation for _, pose in poses]),
        orientations_quat_wxyz=np.roll(np.where(xyzw[:, 3:] < 0, -xyzw, xyzw), 1, axis=1),
        timestamps=np.array([stamp for stamp, _ in poses]) / 1e9,
    )


def _errors(reference: PoseTrajectory3D, estimate: PoseTrajectory3D) -> NDArray[np.float64]:
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((reference, estimate))
    return np.asarray(error.error, np.float64)


def _relative_rmse(reference: PoseTrajectory3D, estimate: PoseTrajectory3D) -> float:
    error = metrics.RPE(
        metrics.PoseRelation.translation_part,
        RELATIVE_M,
        metrics.Unit.meters,
        all_pairs=True,
        pairs_from_reference=True,
    )
    try:
        error.process_data((reference, estimate))
    except FilterException:  # no two poses are that far apart
        return float("nan")
    return _rmse(np.asarray(error.error, np.float64))


def _rmse(errors: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(errors**2)))
