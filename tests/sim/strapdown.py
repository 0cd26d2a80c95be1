"""The slow, obvious integration of an IMU, to hold simulated motion to its own sensors."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from sim.robots.robot_motion import GRAVITY_WORLD, RobotMotion


def integrate_imu(
    motion: RobotMotion, first: int, count: int, step_s: float
) -> tuple[NDArray, NDArray]:
    """IMU positions (count + 1, 3) [m] and rotations (count + 1, 3, 3), from its readings alone.

    Trapezoids from the true state at index `first`.
    """
    rotation, position, velocity = imu_state(motion, first)
    positions, rotations = [position], [rotation]
    for index in range(first, first + count):
        rate = 0.5 * (motion.gyro_imu[index] + motion.gyro_imu[index + 1])
        turned = rotation @ Rotation.from_rotvec(step_s * rate).as_matrix()
        before = rotation @ motion.specific_force_imu[index] + GRAVITY_WORLD
        after = turned @ motion.specific_force_imu[index + 1] + GRAVITY_WORLD
        position = position + step_s * velocity + step_s**2 * (2 * before + after) / 6
        velocity = velocity + step_s * (before + after) / 2
        rotation = turned
        positions.append(position)
        rotations.append(rotation)
    return np.array(positions), np.array(rotations)


def imu_state(motion: RobotMotion, index: int) -> tuple[NDArray, NDArray, NDArray]:
    """Rotation, position and velocity of the IMU in `world`, from the body's true state."""
    imu = motion.mounting.T_body_imu
    rotation = motion.rotations_world[index]
    position = motion.positions_world[index] + rotation @ imu.translation
    swing = np.cross(motion.angular_velocities_body[index], imu.translation)
    return rotation @ imu.rotation, position, motion.velocities_world[index] + rotation @ swing
