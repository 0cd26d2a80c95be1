"""One flight of the MAV: take off, follow the waypoints with some sway, hover at the end."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from sim.robots.paths import minimum_jerk, planar_path, random_curve, scale_jet, sinusoids
from sim.robots.quadrotor import (
    MOUNTING,
    PHYSICS_STEP_S,
    REST_HEIGHT_M,
    quadrotor_model,
    rotor_thrusts,
)
from sim.robots.robot_motion import RobotMotion
from sim.scene import MavPath
from sim.world.magnetic_field import MagneticField

RISE_S = 3.0
SPIN_UP_S = 0.7
ROUNDING_S = 0.6  # keeps the tilt below 10 degrees in a right-angled corner at 0.5 m/s
SETTLE_S = 1.0  # before the log begins, for the feet to settle
WAYPOINT_NOISE_M = 0.05
HEADING_NOISE_RAD = np.deg2rad(4.0)
YAW_SWAY_RAD = np.deg2rad(2.5)
YAW_SWAY_HZ = 0.07
SWAY_SHARE = np.array([0.5, 0.5, 1.0])  # of sway_m along x, y, z
SWAY_HZ = (0.28, 0.42)
GUST_N = np.array([0.12, 0.12, 0.08])
GUST_STEP_S = 0.4


@dataclass(frozen=True, eq=False)
class FlightPlan:
    """What one seed makes of a scene's flight, sampled at the log's times.

    Attributes:
        position: (3, N, 3) jet of the wanted position in `world`.
        heading: (3, N, 1) jet of the wanted heading [rad].
        gust: (N, 3) force of the air on the body [N].
        throttle: (N,) share of the commanded thrust that the rotors get while spinning up.
        floor: Height of the floor at the start [m].
    """

    position: NDArray[np.float64]
    heading: NDArray[np.float64]
    gust: NDArray[np.float64]
    throttle: NDArray[np.float64]
    floor: float


def plan_flight(
    mav: MavPath, floor: float, times: NDArray[np.float64], rng: np.random.Generator
) -> FlightPlan:
    """Vary the scene's flight and sample it.

    Args:
        mav: The scene's flight.
        floor: Height of the floor at `mav.start` [m].
        times: (N,) times of the log [s], starting at 0.
        rng: Makes this flight differ from that of another seed.

    Raises:
        InputError: The time does not suffice to take off, or the waypoints make no path.
    """
    risen_s = mav.takeoff_s + RISE_S
    if times[-1] < risen_s:
        raise InputError(
            f"duration_s = {times[-1]:g} is too short: the MAV takes off at mav.takeoff_s = "
            f"{mav.takeoff_s:g} and needs {RISE_S:g} s to rise, so at least {risen_s:g}"
        )
    waypoints = np.array([mav.start, *mav.waypoints], np.float64).reshape(-1, 2)
    noise = np.clip(rng.standard_normal((len(waypoints) - 1, 2)), -2, 2)
    waypoints[1:] += WAYPOINT_NOISE_M * noise
    path = planar_path(waypoints, mav.speed_mps, risen_s - 1.0, ROUNDING_S)
    aloft = minimum_jerk(times, mav.takeoff_s + 0.5 * RISE_S, RISE_S)
    sway = sinusoids(
        times, mav.sway_m * SWAY_SHARE, rng.uniform(*SWAY_HZ, 3), rng.uniform(0, 2 * np.pi, 3)
    )
    position = scale_jet(sway, aloft)
    position[..., :2] += path.jet(times)
    rise = mav.height_m - REST_HEIGHT_M
    position[..., 2:] += rise * minimum_jerk(times, mav.takeoff_s, RISE_S)
    position[0, :, 2] += floor + REST_HEIGHT_M
    yaw = sinusoids(times, [YAW_SWAY_RAD], [YAW_SWAY_HZ], rng.uniform(0, 2 * np.pi, 1))
    heading = scale_jet(yaw, aloft)
    heading[0] += HEADING_NOISE_RAD * np.clip(rng.standard_normal(), -2, 2)
    gust = random_curve(rng, 0.0, float(times[-1]), GUST_STEP_S, GUST_N).jet(times)
    return FlightPlan(
        position,
        heading,
        scale_jet(gust, aloft)[0],
        minimum_jerk(times, mav.takeoff_s - SPIN_UP_S, SPIN_UP_S)[0, :, 0],
        floor,
    )


def fly(plan: FlightPlan, step_s: float, field: MagneticField) -> RobotMotion:
    """Fly the plan in MuJoCo; a state and its sensor values every `step_s`."""
    x, y, _ = plan.position[0, 0]
    model = quadrotor_model(x, y, plan.floor, float(plan.heading[0, 0, 0]))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=round(SETTLE_S / PHYSICS_STEP_S))
    substeps = round(step_s / PHYSICS_STEP_S)
    mav = model.body("mav").id
    count = len(plan.throttle)
    states, sensors = np.empty((count, 13)), np.empty((count, 6))
    rotations = np.empty((count, 3, 3))
    for index in range(count):
        mujoco.mju_quat2Mat(rotations[index].reshape(9), data.qpos[3:])
        target, heading = plan.position[:, index], plan.heading[:2, index, 0]
        command = rotor_thrusts(
            target, heading, data.qpos[:3], rotations[index], data.qvel[:3], data.qvel[3:]
        )
        data.ctrl[:] = plan.throttle[index] * command
        data.xfrc_applied[mav, :3] = plan.gust[index]
        # Sensor values belong to the logged state only after a forward pass on it.
        mujoco.mj_forward(model, data)
        states[index, :7], states[index, 7:] = data.qpos, data.qvel
        sensors[index] = data.sensordata
        # Held over the step, the gust is the mean of both ends, as trapezoids take it.
        following = plan.gust[min(index + 1, count - 1)]
        data.xfrc_applied[mav, :3] = 0.5 * (plan.gust[index] + following)
        mujoco.mj_step(model, data, nstep=substeps)
    return RobotMotion.in_field(
        field,
        MOUNTING,
        positions_world=states[:, :3],
        rotations_world=rotations,
        velocities_world=states[:, 7:10],
        angular_velocities_body=states[:, 10:],
        specific_force_imu=sensors[:, 3:],
        gyro_imu=sensors[:, :3],
    )
