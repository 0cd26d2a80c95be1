"""How one robot moved, and what perfect inertial and magnetic sensors on it would read."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.core.arrays import read_only
from airground.core.se3 import SE3, nearest_rotation
from sim.world.magnetic_field import MagneticField

GRAVITY_WORLD = np.array([0.0, 0.0, -9.81])


@dataclass(frozen=True, eq=False)
class Mounting:
    """Where a robot's sensors really are.

    Attributes:
        T_body_imu: The IMU (and magnetometer) in the body (x forward, z up).
        T_imu_camera: The camera (x right, y down, z forward) in the IMU's frame.
    """

    T_body_imu: SE3
    T_imu_camera: SE3

    @property
    def T_body_camera(self) -> SE3:
        return self.T_body_imu @ self.T_imu_camera


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """The states of one robot at the stamps of a `Motion`, all exact and noise-free.

    Attributes:
        positions_world: (N, 3) origin of the body [m].
        rotations_world: (N, 3, 3) body to world.
        velocities_world: (N, 3) velocities of the body's origin [m/s].
        angular_velocities_body: (N, 3) angular velocities of the body [rad/s].
        specific_force_imu: (N, 3) specific forces at the IMU, in its frame [m/s^2]; +9.81 upwards
            at rest.
        gyro_imu: (N, 3) in the IMU's frame [rad/s].
        field_imu: (N, 3) whole magnetic field in the IMU's frame [T].
        anomaly_imu: (N, 3) the part of `field_imu` that iron in the room adds [T].
        mounting: Poses of its sensors.
    """

    positions_world: NDArray[np.float64]
    rotations_world: NDArray[np.float64]
    velocities_world: NDArray[np.float64]
    angular_velocities_body: NDArray[np.float64]
    specific_force_imu: NDArray[np.float64]
    gyro_imu: NDArray[np.float64]
    field_imu: NDArray[np.float64]
    anomaly_imu: NDArray[np.float64]
    mounting: Mounting

    def __post_init__(self) -> None:
        count = len(self.positions_world)
        for name in ARRAY_NAMES:
            shape = (count, 3, 3) if name == "rotations_world" else (count, 3)
            array = read_only(getattr(self, name), name, shape, np.float64)
            if not np.isfinite(array).all():
                raise ValueError(f"{name}: every number must be finite")
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return len(self.positions_world)

    @classmethod
    def in_field(cls, field: MagneticField, mounting: Mounting, **states: NDArray) -> RobotMotion:
        """The motion with its magnetometer readings computed from the states."""
        positions, rotations = states["positions_world"], states["rotations_world"]
        imu = mounting.T_body_imu
        places = positions + rotations @ imu.translation
        to_imu = np.swapaxes(rotations @ imu.rotation, 1, 2)
        return cls(
            mounting=mounting,
            field_imu=np.einsum("nij,nj->ni", to_imu, field.at(places)),
            anomaly_imu=np.einsum("nij,nj->ni", to_imu, field.anomaly(places)),
            **states,
        )

    def pose(self, index: int, fraction: float, step_s: float) -> SE3:
        """T_world_body between two states, by cubic Hermite interpolation.

        Position and rotation (in the tangent space of the first state) match value and rate
        at both ends, so the error falls with the fourth power of the step.

        Args:
            index: Index of the state before.
            fraction: In [0, 1], of the way to the next.
            step_s: Time between the two states [s].
        """
        if fraction == 0.0:
            return SE3(self.rotations_world[index], self.positions_world[index])
        start, end = self.rotations_world[index], self.rotations_world[index + 1]
        turn = Rotation.from_matrix(start.T @ end).as_rotvec()
        turn_rate_end = _inverse_right_jacobian(turn) @ self.angular_velocities_body[index + 1]
        vector = _hermite(
            fraction,
            step_s,
            (np.zeros(3), self.angular_velocities_body[index]),
            (turn, turn_rate_end),
        )
        position = _hermite(
            fraction,
            step_s,
            (self.positions_world[index], self.velocities_world[index]),
            (self.positions_world[index + 1], self.velocities_world[index + 1]),
        )
        rotation = start @ Rotation.from_rotvec(vector).as_matrix()
        return SE3(nearest_rotation(rotation), position)


ARRAY_NAMES = tuple(f.name for f in fields(RobotMotion) if f.name != "mounting")


def ideal_imu(
    rotations_world: NDArray,
    accelerations_world: NDArray,
    angular_velocities_body: NDArray,
    angular_accelerations_body: NDArray,
    T_body_imu: SE3,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What a perfect IMU off the body's origin reads: (gyro_imu, specific_force_imu).

    f_body = R^T (a - g) + alpha x r + omega x (omega x r), with r the lever arm.

    Args:
        rotations_world: (N, 3, 3) body to world.
        accelerations_world: (N, 3) accelerations of the body's origin [m/s^2].
        angular_velocities_body: (N, 3) angular velocities of the body [rad/s].
        angular_accelerations_body: (N, 3) angular accelerations of the body [rad/s^2].
        T_body_imu: The IMU in the body.

    Returns:
        Two arrays (N, 3) in the IMU's frame [rad/s], [m/s^2].
    """
    arm = T_body_imu.translation
    omega = angular_velocities_body
    at_origin = np.einsum("nji,nj->ni", rotations_world, accelerations_world - GRAVITY_WORLD)
    force_body = (
        at_origin
        + np.cross(angular_accelerations_body, arm)
        + np.cross(omega, np.cross(omega, arm))
    )
    return omega @ T_body_imu.rotation, force_body @ T_body_imu.rotation


def _hermite(
    fraction: float, step_s: float, start: tuple[NDArray, NDArray], end: tuple[NDArray, NDArray]
) -> NDArray:
    """Cubic through (value, rate) at both ends of a step."""
    u = fraction
    return (
        (1 + 2 * u) * (1 - u) ** 2 * start[0]
        + u * (1 - u) ** 2 * step_s * start[1]
        + u**2 * (3 - 2 * u) * end[0]
        + u**2 * (u - 1) * step_s * end[1]
    )


def _inverse_right_jacobian(phi: NDArray) -> NDArray[np.float64]:
    """Maps the body's rate to that of the rotation vector; third order, for small turns."""
    skew = np.array([[0, -phi[2], phi[1]], [phi[2], 0, -phi[0]], [-phi[1], phi[0], 0]])
    return np.eye(3) + 0.5 * skew + skew @ skew / 12.0
