"""A robot that is lifted and set down where it was before."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from airground.core.se3 import SE3
from sim.robots.robot_motion import ARRAY_NAMES, RobotMotion


def carried_back(
    motion: RobotMotion, start: int, end: int, back: int, step_s: float
) -> RobotMotion:
    """The motion of a robot that is carried back along its own path and drives on from there.

    Poses and velocities are exact throughout. While it is carried, the inertial readings are those
    of the path's nearest state: its IMU is taken to be off.

    Args:
        motion: Motion without the carrying.
        start, end: States between which the robot is carried.
        back: The robot is set down at the pose of the state `start` - `back`.
        step_s: Time from state to state [s].
    """
    count = len(motion)
    sources = np.arange(count, dtype=np.float64)
    share = (np.arange(start, end + 1) - start) / max(end - start, 1)
    sources[start : end + 1] = start - back * share**2 * (3 - 2 * share)
    sources[end + 1 :] -= end - start + back
    nearest = np.rint(sources).astype(np.int64)
    arrays = {name: getattr(motion, name)[nearest] for name in ARRAY_NAMES}
    poses = [_pose_at(motion, source, step_s) for source in sources[start : end + 1]]
    rotations = np.stack([pose.rotation for pose in poses])
    positions = np.stack([pose.translation for pose in poses])
    carried = slice(start, end + 1)
    arrays["rotations_world"][carried] = rotations
    arrays["positions_world"][carried] = positions
    if len(poses) > 1:
        arrays["velocities_world"][carried] = np.gradient(positions, step_s, axis=0)
        turns = [one.inverse() @ other for one, other in pairwise(poses)]
        rates = np.stack([turn.rotation_vector() for turn in turns]) / step_s
        arrays["angular_velocities_body"][start:end] = rates
    return RobotMotion(mounting=motion.mounting, **arrays)


def _pose_at(motion: RobotMotion, source: float, step_s: float) -> SE3:
    index = min(int(source), len(motion) - 2)
    return motion.pose(index, source - index, step_s)
