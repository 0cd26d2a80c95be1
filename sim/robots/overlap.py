"""How much of what the MAV flies over the ground robot has seen before, and when it has.

`python -m sim.robots.overlap SCENE [SEED...]` prints it; a scene file states it as
`overlap_expected`. Computed along the nominal paths by ray casting at low resolution.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.errors import InputError
from sim.geometry.surface import RayCaster
from sim.robots.flight import RISE_S
from sim.robots.ground_robot import CAMERA_FORWARD_M, REST_S
from sim.robots.paths import cut_headings, heading_path, planar_path
from sim.scene import GroundPath, Scene, load_scene
from sim.world.world import World, build_world

CELL_M = 0.04
GROUND_RANGE_M = 4.0
FLIGHT_STEP_M = 0.7
_DRIVE_STEP_S = 0.5
_REACH_S = 1.5  # what the rounding of its corners adds to a heading_path
# Focal length, columns and rows of a quarter of the ground camera's and an eighth of the MAV's
# resolution (its footprint is twice as far away and its cells as large).
_GROUND_IMAGE = (525 / 4, 160, 120)
_MAV_IMAGE = (8, 94, 60)


@dataclass(frozen=True, eq=False)
class Sights:
    """What each robot sees, and when, along the nominal paths.

    Attributes:
        first_seen: (X, Y) time at which the ground camera first sees each cell of the floor on its
            whole drive [s]; infinite where it never does.
        flown: Times at which an aerial map appears, every 0.7 m of flight [s], and the
            filled cells (X, Y) of its footprint there.
    """

    first_seen: NDArray[np.float64]
    flown: list[tuple[float, NDArray[np.bool_]]]

    @classmethod
    def of(cls, world: World, ground: GroundPath) -> Sights:
        """With the ground robot on this path."""
        scene = world.scene
        caster = RayCaster((world.vertices, world.triangles))
        shape = np.ceil(np.array(scene.room.size_m) / CELL_M).astype(int)
        flown = []
        for time, place in zip(*_flight(scene), strict=True):
            cells = _cells(_look_down(world, caster, place), scene, shape)
            footprint = np.zeros(shape, bool)
            footprint[cells[:, 0], cells[:, 1]] = True
            flown.append((float(time), footprint))
        return cls(_first_seen(world, ground, caster, shape), flown)

    def shares(self, until_s: float = np.inf) -> NDArray[np.float64]:
        """(K,) share of each footprint that the robot has seen by then, if it stops at a time."""
        return np.array(
            [(self.first_seen[seen] <= min(time, until_s)).mean() for time, seen in self.flown]
        )


def overlap_along_flight(world: World) -> NDArray[np.float64]:
    """(K,) share of the MAV's footprint, in filled cells, that the robot has seen by then.

    One entry every 0.7 m of flight, as often as an aerial map appears.
    """
    return Sights.of(world, driven_path(world)).shares()


def driven_path(world: World) -> GroundPath:
    """The ground robot's path, cut where `ground.stop_at_overlap` has it stop.

    Raises:
        InputError: It sees more than that before it moves, or less on its whole drive.
    """
    scene, ground = world.scene, world.scene.ground
    wanted = ground.stop_at_overlap
    if wanted is None:
        return ground
    sights = Sights.of(world, ground)
    stops = np.arange(0, scene.duration_s, _DRIVE_STEP_S)
    reached = np.array([np.median(sights.shares(stop)) for stop in stops])
    moving = REST_S + _REACH_S + _DRIVE_STEP_S
    least, most = reached[np.searchsorted(stops, moving)], reached[-1]
    if not least <= wanted <= most:
        raise InputError(
            f"scene '{scene.name}', seed {world.seed}: ground.stop_at_overlap = {wanted:g} cannot "
            f"be had: the robot sees {least:.2f} as it sets off and {most:.2f} on its whole drive"
        )
    stop_s = max(moving, float(stops[np.argmax(reached >= wanted)]))
    waypoints = np.array(ground.waypoints) * [1, 1, np.pi / 180]
    driven_s = stop_s - REST_S - _REACH_S
    cut = cut_headings(waypoints, ground.speed_mps, np.radians(ground.turn_dps), driven_s)
    kept = tuple((float(x), float(y), float(np.rad2deg(heading))) for x, y, heading in cut)
    return ground.model_copy(update={"waypoints": kept})


def _flight(scene: Scene) -> tuple[NDArray, NDArray]:
    """Times (K,) [s] and places (K, 2) [m] every 0.7 m of flight at full height."""
    mav = scene.mav
    path = planar_path([mav.start, *mav.waypoints], mav.speed_mps, mav.takeoff_s + RISE_S - 1.0)
    times = np.arange(mav.takeoff_s + RISE_S, scene.duration_s, 0.1)
    places, velocities, _ = path.jet(times)
    travelled = np.cumsum(np.linalg.norm(velocities, axis=1)) * 0.1
    keep = np.searchsorted(travelled, np.arange(FLIGHT_STEP_M / 2, travelled[-1], FLIGHT_STEP_M))
    return times[keep], places[keep]


def _first_seen(
    world: World, ground: GroundPath, caster: RayCaster, shape: NDArray
) -> NDArray[np.float64]:
    """(X, Y) when the ground camera first saw each cell [s]; infinite where it never did."""
    waypoints = np.array(ground.waypoints) * [1, 1, np.pi / 180]
    path = heading_path(waypoints, ground.speed_mps, np.radians(ground.turn_dps), REST_S)
    first = np.full(shape, np.inf)
    pitch = np.radians(ground.camera_pitch_deg)
    for time in np.arange(0, min(path.end_s, world.scene.duration_s), _DRIVE_STEP_S):
        x, y, heading = path.jet(np.array([time]))[0][0]
        ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
        place = np.array([x, y, float(world.floor_height(x, y)) + ground.camera_height_m])
        forward = np.cos(pitch) * ahead + [0, 0, -np.sin(pitch)]
        right = np.array([ahead[1], -ahead[0], 0.0])
        place = place + CAMERA_FORWARD_M * ahead
        points = _cast(caster, place, right, forward, _GROUND_IMAGE, GROUND_RANGE_M)
        cells = _cells(points, world.scene, shape)
        first[cells[:, 0], cells[:, 1]] = np.minimum(first[cells[:, 0], cells[:, 1]], time)
    return first


def _look_down(world: World, caster: RayCaster, place: NDArray) -> NDArray:
    mav = world.scene.mav
    height = float(world.floor_height(*mav.start)) + mav.height_m
    focal = mav.camera_f_px / _MAV_IMAGE[0]
    origin = np.array([*place, height])
    down, right = np.array([0, 0, -1.0]), np.array([0, -1.0, 0])
    return _cast(caster, origin, right, down, (focal, *_MAV_IMAGE[1:]), np.inf)


def _cast(
    caster: RayCaster,
    place: NDArray,
    right: NDArray,
    forward: NDArray,
    image: tuple[float, int, int],
    range_m: float,
) -> NDArray[np.float64]:
    """(N, 3) points that a camera sees up to a depth of `range_m`."""
    focal, columns, rows = image
    x = (np.arange(columns) - (columns - 1) / 2) / focal
    y = (np.arange(rows) - (rows - 1) / 2) / focal
    down = np.cross(forward, right)
    directions = forward + x[None, :, None] * right + y[:, None, None] * down
    rays = np.empty((rows, columns, 6), np.float32)
    rays[..., :3], rays[..., 3:] = place, directions
    depth, _ = caster.hits(rays)
    seen = np.isfinite(depth) & (depth <= range_m)
    return place + depth[seen][:, None].astype(np.float64) * directions[seen]


def _cells(points: NDArray, scene: Scene, shape: NDArray) -> NDArray[np.int64]:
    """(N, 2) cell of every point over the floor; walls and what lies outside are left out."""
    cells = np.floor((points[:, :2] + np.array(scene.room.size_m) / 2) / CELL_M).astype(int)
    return cells[((cells > 0) & (cells < shape - 1)).all(1)]


def main(arguments: list[str]) -> None:
    scene = load_scene(arguments[0])
    for seed in map(int, arguments[1:] or ["0", "1", "2"]):
        shares = overlap_along_flight(build_world(scene, seed, pictures=False))
        sys.stdout.write(
            f"{scene.name} seed {seed}: median {np.median(shares):.2f}, lowest "
            f"{shares.min():.2f}, {(shares > 0.5).mean():.0%} of {len(shares)} maps above 0.5, "
            f"first 12 {np.median(shares[:12]):.2f}\n"
        )


if __name__ == "__main__":
    main(sys.argv[1:])
