"""Both robots in laps that repeat exactly, after take-off.

A lap begins and ends at rest in one place. Sway has whole numbers of cycles in it and gusts
fade at its ends, so that the flight closes on itself; the ground robot's path returns to its first
waypoint.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.robots.flight import (
    GUST_N,
    GUST_STEP_S,
    RISE_S,
    ROUNDING_S,
    SPIN_UP_S,
    SWAY_HZ,
    SWAY_SHARE,
    YAW_SWAY_HZ,
    YAW_SWAY_RAD,
    FlightPlan,
    fly,
)
from sim.robots.ground_robot import Drive, chassis_curve, drive, floor_under, mounting
from sim.robots.motion import RATE_HZ, STEP_NS, Motion
from sim.robots.paths import (
    heading_path,
    minimum_jerk,
    planar_path,
    random_curve,
    scale_jet,
    sinusoids,
)
from sim.robots.quadrotor import REST_HEIGHT_M
from sim.robots.robot_motion import ARRAY_NAMES, RobotMotion
from sim.scene import GroundPath, MavPath, Scene
from sim.world.magnetic_field import room_field
from sim.world.world import World

BEFORE_S = 12.0
"""Time before the first lap: rest, take-off, and hovering until the flight has settled [s]."""
TAKEOFF_S = 2.0
CALM_S = 2.0
"""Time at either end of a lap in which gusts fade [s]."""
SETTLING_S = 5.0
"""Time at a lap's end without path or gusts, in which what the controller is off dies out [s]."""
UNIT_S = 0.1
"""Laps are whole numbers of it: three images, twenty states of the motion [s]."""
CLOSED_M = 1e-5
"""Largest step where a lap joins the next [m]."""


@dataclass(frozen=True)
class Laps:
    """Where the robots are, and how long a lap takes [s]."""

    motion: Motion
    lap_s: float


@dataclass(frozen=True, eq=False)
class ClosedDrive(Drive):
    """A drive whose wheels end as they began: what rattles moves back over the lap [s]."""

    lap_s: float

    def jets(self, times: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        position, angles = super().jets(times)
        (ends, turns), along = super().jets([0.0, self.lap_s]), minimum_jerk(times, 0.0, self.lap_s)
        position[..., 2:] -= along * (ends[0, 1, 2:] - ends[0, 0, 2:])
        angles[..., :2] -= along * (turns[0, 1, :2] - turns[0, 0, :2])
        return position, angles


def fly_laps(world: World, scene: Scene, seed: int, duration_s: float) -> Laps:
    """Laps over a scene's waypoints and back to the first; the same seed gives the same bytes."""
    flight_rng, drive_rng, field_rng = np.random.default_rng(seed).spawn(3)
    half = np.array(scene.room.size_m) / 2
    floor = float(floor_under(world.floor_height, np.array([scene.mav.start]), "mav.start")[0])
    field = room_field(field_rng, -half, half, floor)
    route = _closed_route(scene.ground, world, drive_rng)
    waypoints = [scene.mav.start, *scene.mav.waypoints, scene.mav.start]
    path = planar_path(waypoints, scene.mav.speed_mps, 0.0, ROUNDING_S)
    lap_s = float(np.ceil((max(path.end_s, route.planar.end_s) + SETTLING_S) / UNIT_S)) * UNIT_S
    before, lap = round(BEFORE_S * RATE_HZ), round(lap_s * RATE_HZ)
    times = (np.arange(before + lap + 1) - before) / RATE_HZ
    plan = _flight_plan(scene.mav, path.jet(times), floor, times, lap_s, flight_rng)
    closed = ClosedDrive(route.planar, route.chassis, lap_s)
    mav = fly(plan, 1.0 / RATE_HZ, field)
    ground = drive(closed, times, mounting(scene.ground), field)
    count = round(duration_s * RATE_HZ) + 1
    rows = np.arange(count)
    rows[before:] = before + (rows[before:] - before) % lap
    stamps_ns = np.arange(count, dtype=np.int64) * STEP_NS
    repeated = (_repeated(one, rows, before, lap) for one in (mav, ground))
    return Laps(Motion(stamps_ns, *repeated), lap_s)


def _closed_route(ground: GroundPath, world: World, rng: np.random.Generator) -> Drive:
    waypoints = np.array([*ground.waypoints, ground.waypoints[0]]) * [1, 1, np.pi / 180]
    planar = heading_path(waypoints, ground.speed_mps, np.deg2rad(ground.turn_dps), 0.0)
    return Drive(planar, chassis_curve(planar, world.floor_height, rng))


def _flight_plan(
    mav: MavPath,
    path: NDArray[np.float64],
    floor: float,
    times: NDArray[np.float64],
    lap_s: float,
    rng: np.random.Generator,
) -> FlightPlan:
    """Take-off and one lap, which begins at time 0; `path` is the (3, N, 2) jet over the floor."""
    takeoff_s = TAKEOFF_S - BEFORE_S
    aloft = minimum_jerk(times, takeoff_s + 0.5 * RISE_S, RISE_S)
    sway_hz = np.round(rng.uniform(*SWAY_HZ, 3) * lap_s) / lap_s
    sway = sinusoids(times, mav.sway_m * SWAY_SHARE, sway_hz, rng.uniform(0, 2 * np.pi, 3))
    position = scale_jet(sway, aloft)
    position[..., :2] += path
    position[..., 2:] += (mav.height_m - REST_HEIGHT_M) * minimum_jerk(times, takeoff_s, RISE_S)
    position[0, :, 2] += floor + REST_HEIGHT_M
    yaw_hz = max(round(YAW_SWAY_HZ * lap_s), 1) / lap_s
    yaw = sinusoids(times, [YAW_SWAY_RAD], [yaw_hz], rng.uniform(0, 2 * np.pi, 1))
    gust = random_curve(rng, 0.0, lap_s, GUST_STEP_S, GUST_N).jet(times)[0]
    windy = minimum_jerk(times, 0.0, CALM_S)[0]
    windy = windy * (1.0 - minimum_jerk(times, lap_s - SETTLING_S - CALM_S, CALM_S)[0])
    throttle = minimum_jerk(times, takeoff_s - SPIN_UP_S, SPIN_UP_S)[0, :, 0]
    return FlightPlan(position, scale_jet(yaw, aloft), windy * gust, throttle, floor)


def _repeated(robot: RobotMotion, rows: NDArray[np.int64], before: int, lap: int) -> RobotMotion:
    """The motion with its lap over and over; ValueError if the lap is not closed."""
    places = robot.positions_world
    step_m = float(np.abs(places[before + lap] - places[before]).max())
    turned = float(
        np.abs(robot.rotations_world[before + lap] - robot.rotations_world[before]).max()
    )
    if max(step_m, turned) > CLOSED_M:
        raise ValueError(f"the lap is not closed: by {step_m:.1e} m, {turned:.1e} rad")
    return replace(robot, **{name: getattr(robot, name)[rows] for name in ARRAY_NAMES})
