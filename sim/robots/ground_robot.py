"""The ground robot: an omnidirectional base driven along its path, closed form throughout.

The base follows the floor under its four wheels and rattles a little over what the floor's
model leaves out. Everything is a spline of time, so that velocity, acceleration and the
IMU are exact derivatives of the pose.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from airground.core.se3 import SE3
from airground.errors import InputError
from sim.robots.paths import SmoothCurve, WaypointPath, heading_path, random_curve
from sim.robots.robot_motion import Mounting, RobotMotion, ideal_imu
from sim.scene import GroundPath
from sim.world.magnetic_field import MagneticField

FloorHeight = Callable[[ArrayLike, ArrayLike], NDArray[np.float64]]
"""Height of the floor [m] at x, y [m] in `world`; NaN where there is none."""

REST_S = 1.0  # it stands still at first, as one does to measure an IMU's bias
HALF_WHEELBASE_M = 0.2
IMU_PLACE_BODY = np.array([0.05, 0.02, 0.15])
IMU_TURN = np.pi / 2  # about z: the IMU's x axis points to the robot's left
CAMERA_FORWARD_M = 0.15
CHASSIS_STEP_S = 0.05
# The rattle: what 8 cm of floor change, as deviations of height [m], roll and pitch [rad].
RATTLE_TRAVEL_M = 0.08
RATTLE = np.array([0.0012, np.deg2rad(0.15), np.deg2rad(0.15)])
WAYPOINT_NOISE_M = 0.02
HEADING_NOISE_RAD = np.deg2rad(1.5)


@dataclass(frozen=True, eq=False)
class Drive:
    """The motion of the base as a function of time.

    Attributes:
        planar: Path of (x, y, heading) [m, m, rad].
        chassis: Curve of (z, roll, pitch) [m, rad, rad]; z is that of the body's origin,
            between the wheels on the floor.
    """

    planar: WaypointPath
    chassis: SmoothCurve

    def jets(self, times: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(3, N, 3) position in `world` and (3, N, 3) roll, pitch, yaw."""
        planar, chassis = self.planar.jet(times), self.chassis.jet(times)
        position = np.concatenate([planar[..., :2], chassis[..., :1]], axis=2)
        angles = np.concatenate([chassis[..., 1:], planar[..., 2:]], axis=2)
        return position, angles


def mounting(ground: GroundPath) -> Mounting:
    """The true places of IMU and camera for a scene's camera height and pitch."""
    T_body_imu = SE3.from_heading(IMU_TURN, IMU_PLACE_BODY)
    pitch = np.deg2rad(ground.camera_pitch_deg)
    # Columns: the camera's right, down and forward axes in the body.
    right = [0.0, -1.0, 0.0]
    down = [-np.sin(pitch), 0.0, -np.cos(pitch)]
    forward = [np.cos(pitch), 0.0, -np.sin(pitch)]
    place = np.array([CAMERA_FORWARD_M, 0.0, ground.camera_height_m])
    T_body_camera = SE3(np.column_stack([right, down, forward]), place)
    return Mounting(T_body_imu, T_body_imu.inverse() @ T_body_camera)


def plan_drive(ground: GroundPath, floor: FloorHeight, rng: np.random.Generator) -> Drive:
    """The drive of one seed: the scene's waypoints, each a little off.

    Raises:
        InputError: The waypoints or limits make no path.
    """
    waypoints = np.array(ground.waypoints, np.float64).reshape(-1, 3) * [1, 1, np.pi / 180]
    noise = np.clip(rng.standard_normal(waypoints.shape), -2, 2)
    waypoints += noise * [WAYPOINT_NOISE_M, WAYPOINT_NOISE_M, HEADING_NOISE_RAD]
    turn_rps = np.deg2rad(ground.turn_dps)
    planar = heading_path(waypoints, ground.speed_mps, turn_rps, REST_S)
    return Drive(planar, chassis_curve(planar, floor, rng))


def drive(
    plan: Drive, times: NDArray[np.float64], sensors: Mounting, field: MagneticField
) -> RobotMotion:
    """States and ideal sensor values at `times` (N,) [s]."""
    position, angles = plan.jets(times)
    rotations, omega, alpha = euler_kinematics(angles)
    gyro, force = ideal_imu(rotations, position[2], omega, alpha, sensors.T_body_imu)
    return RobotMotion.in_field(
        field,
        sensors,
        positions_world=position[0],
        rotations_world=rotations,
        velocities_world=position[1],
        angular_velocities_body=omega,
        specific_force_imu=force,
        gyro_imu=gyro,
    )


def chassis_curve(
    planar: WaypointPath, floor: FloorHeight, rng: np.random.Generator
) -> SmoothCurve:
    """Height and tilt from the floor under the wheels, plus a rattle that grows with travel."""
    margin = 3 * CHASSIS_STEP_S
    times = np.arange(-margin, planar.end_s + 2 * margin, CHASSIS_STEP_S)
    value, rate, _ = planar.jet(times)
    heading = value[:, 2]
    ahead = HALF_WHEELBASE_M * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    front_left, front_right, rear_left, rear_right = (
        floor_under(
            floor, value[:, :2] + along * ahead + across * left, "ground.waypoints: a wheel"
        )
        for along, across in ((1, 1), (1, -1), (-1, 1), (-1, -1))
    )
    track = 4 * HALF_WHEELBASE_M
    height = (front_left + front_right + rear_left + rear_right) / 4
    roll = np.arctan2(front_left + rear_left - front_right - rear_right, track)
    pitch = -np.arctan2(front_left + front_right - rear_left - rear_right, track)
    rolling = np.hypot(np.linalg.norm(rate[:, :2], axis=1), HALF_WHEELBASE_M * rate[:, 2])
    travel = np.cumsum(rolling) * CHASSIS_STEP_S
    rattle = random_curve(rng, 0.0, travel[-1], RATTLE_TRAVEL_M, RATTLE).jet(travel)[0]
    return SmoothCurve(
        np.stack([height, roll, pitch], axis=1) + rattle, float(times[0]), CHASSIS_STEP_S
    )


def floor_under(floor: FloorHeight, points: NDArray, what: str) -> NDArray[np.float64]:
    """(N,) height of the floor [m] under (N, 2) points.

    Raises:
        InputError: There is no floor under one of them; `what` names its path.
    """
    heights = np.asarray(floor(points[:, 0], points[:, 1]), np.float64)
    missing = np.flatnonzero(~np.isfinite(heights))
    if len(missing):
        x, y = points[missing[0]]
        raise InputError(f"{what} leaves the floor at x = {x:.2f}, y = {y:.2f} m")
    return heights


def euler_kinematics(
    angles: NDArray,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Rotation, angular velocity and acceleration of R = Rz(yaw) Ry(pitch) Rx(roll).

    Args:
        angles: (3, N, 3) jet of roll, pitch, yaw [rad].

    Returns:
        (N, 3, 3) body to world, (N, 3) rates in the body [rad/s], (N, 3) their derivative.
    """
    (roll, pitch, yaw), (droll, dpitch, dyaw), (ddroll, ddpitch, ddyaw) = np.moveaxis(angles, 2, 1)
    sr, cr, sp, cp, sy, cy = (f(a) for a in (roll, pitch, yaw) for f in (np.sin, np.cos))
    rotations = np.stack(
        [
            np.stack([cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr], axis=1),
            np.stack([sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr], axis=1),
            np.stack([-sp, cp * sr, cp * cr], axis=1),
        ],
        axis=1,
    )
    omega = np.stack(
        [droll - dyaw * sp, dpitch * cr + dyaw * cp * sr, -dpitch * sr + dyaw * cp * cr], axis=1
    )
    alpha = np.stack(
        [
            ddroll - ddyaw * sp - dyaw * dpitch * cp,
            ddpitch * cr
            - dpitch * droll * sr
            + ddyaw * cp * sr
            - dyaw * dpitch * sp * sr
            + dyaw * droll * cp * cr,
            -ddpitch * sr
            - dpitch * droll * cr
            + ddyaw * cp * cr
            - dyaw * dpitch * sp * cr
            - dyaw * droll * cp * sr,
        ],
        axis=1,
    )
    return rotations, omega, alpha
