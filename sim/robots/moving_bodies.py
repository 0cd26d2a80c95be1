"""When what body is where: paths of a scene's bodies, and the ground robot as a body that is seen.

Stored beside the truth as `bodies.csv` and a trajectory each, from which images are drawn.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import InputError, RecordingError
from airground.io.input_files import TEXT_LIMIT, read_text
from airground.io.tum import read_tum, write_tum
from sim.robots.ground_robot import floor_under
from sim.robots.motion import Motion, Robot
from sim.robots.paths import planar_path
from sim.scene import Scene
from sim.scene.bodies import Body

if TYPE_CHECKING:
    from sim.world.world import World

GROUND_ROBOT = "ground_robot"
"""Name of the ground robot as a body."""
TABLE = "bodies.csv"
_COLUMNS = ["name", "shape", "height [m]"]
_STEP_NS = 20_000_000
"""Poses of a body are stored so often, and linear in between: at 3 m/s and 90 deg/s within 1 mm."""
_TURN_S = 0.4  # half the time in which a body turns at a corner
_MOVES_MPS = 0.02


@dataclass(frozen=True, eq=False)
class MovingBody:
    """A body and its path.

    Attributes:
        name: Unique name.
        shape: "person" or "robot".
        height_m: Height of a robot's mast [m]; None for the shape's own.
        path: Poses `T_world_body`; the body's origin is on the floor, x is forward.
    """

    name: str
    shape: str
    height_m: float | None
    path: Trajectory

    def pose(self, time_ns: int) -> SE3:
        """`T_world_body` at a time [ns], held before the first pose and after the last."""
        first, last = int(self.path.stamps_ns[0]), int(self.path.stamps_ns[-1])
        return self.path.at(min(max(time_ns, first), last))

    def seen_by(self, robot: Robot) -> bool:
        """Whether a robot sees it: the ground robot does not see itself."""
        return not (robot == "ground" and self.name == GROUND_ROBOT)


def moving_bodies(scene: Scene, world: World, motion: Motion) -> tuple[MovingBody, ...]:
    """The bodies of a scene along their paths, and the ground robot if it is visible.

    Raises:
        InputError: A path leaves the floor, or two bodies have one name.
    """
    bodies = [_walking(body, world, int(motion.stamps_ns[-1])) for body in scene.bodies]
    if scene.ground.visible:
        states = motion.ground
        every = slice(None, None, _STEP_NS // 5_000_000)
        path = Trajectory(
            motion.stamps_ns[every], states.rotations_world[every], states.positions_world[every]
        )
        bodies.append(MovingBody(GROUND_ROBOT, "robot", scene.ground.camera_height_m, path))
    names = [body.name for body in bodies]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"scene '{scene.name}': two bodies are named '{name}'")
    return tuple(bodies)


def _walking(body: Body, world: World, last_ns: int) -> MovingBody:
    stamps_ns = np.arange(0, last_ns + _STEP_NS, _STEP_NS, dtype=np.int64)
    path = planar_path(body.waypoints, body.speed_mps, body.start_s, _TURN_S)
    places, velocities, _ = path.jet(stamps_ns * 1e-9)
    heights = floor_under(world.floor_height, places, f"path of body '{body.name}'")
    headings = _headings(velocities, np.diff(body.waypoints[:2], axis=0)[0])
    c, s, o = np.cos(headings), np.sin(headings), np.zeros(len(headings))
    rotations = np.stack([c, -s, o, s, c, o, o, o, o + 1], axis=1).reshape(-1, 3, 3)
    poses = Trajectory(stamps_ns, rotations, np.column_stack([places, heights]))
    return MovingBody(body.name, body.shape, None, poses)


def _headings(velocities: NDArray, first: NDArray) -> NDArray[np.float64]:
    """(N,) direction of travel [rad]; that of the last move where a body stands."""
    moving = np.linalg.norm(velocities, axis=1) > _MOVES_MPS
    latest = np.maximum.accumulate(np.where(moving, np.arange(len(moving)), -1))
    direction = np.where((latest >= 0)[:, None], velocities[latest], first)
    return np.arctan2(direction[:, 1], direction[:, 0])


def write_bodies(folder: Path, bodies: Sequence[MovingBody]) -> None:
    """Write `bodies.csv` and `body_NAME.tum` into the truth; nothing if there are no bodies."""
    if not bodies:
        return
    with (folder / TABLE).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_COLUMNS)
        writer.writerows(
            [b.name, b.shape, "" if b.height_m is None else b.height_m] for b in bodies
        )
    for body in bodies:
        write_tum(_path_file(folder, body.name), body.path)


def read_bodies(folder: Path) -> tuple[MovingBody, ...]:
    """Read what `write_bodies` wrote; RecordingError names what is wrong."""
    path = folder / TABLE
    if not path.exists():
        return ()
    rows = list(csv.reader(read_text(path, TEXT_LIMIT).splitlines()))
    if not rows or rows[0] != _COLUMNS:
        raise RecordingError(f"{path}:1: must be the columns {','.join(_COLUMNS)}")
    return tuple(_body(folder, row, f"{path}:{line}") for line, row in enumerate(rows[1:], start=2))


def _body(folder: Path, row: list[str], where: str) -> MovingBody:
    try:
        name, shape, height = row
        if not name.isidentifier() or shape not in ("person", "robot"):
            raise ValueError
        height_m = float(height) if height else None
    except ValueError:
        raise RecordingError(
            f"{where}: must be a name, person or robot, and a height [m] or nothing"
        ) from None
    return MovingBody(name, shape, height_m, read_tum(_path_file(folder, name)))


def _path_file(folder: Path, name: str) -> Path:
    return folder / f"body_{name}.tum"
