"""Both robots' motion through a world: simulated once, stored, and read at any time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import read_only
from airground.core.se3 import SE3
from airground.errors import InputError
from airground.io.array_files import UNREADABLE_ARRAYS, read_arrays
from sim.robots.robot_motion import ARRAY_NAMES, Mounting, RobotMotion
from sim.scene import Scene
from sim.world.magnetic_field import room_field

if TYPE_CHECKING:
    from sim.world.world import World

Robot = Literal["mav", "ground"]
ROBOTS: tuple[Robot, ...] = ("mav", "ground")

RATE_HZ = 200
STEP_NS = 1_000_000_000 // RATE_HZ
_FORMAT = 1


@dataclass(frozen=True, eq=False)
class Motion:
    """What both robots did, at 200 Hz from time 0.

    Attributes:
        stamps_ns: (N,) int64, 0, 5e6, 1e7, ...
        mav, ground: Their states at these stamps.
    """

    stamps_ns: NDArray[np.int64]
    mav: RobotMotion
    ground: RobotMotion

    def __post_init__(self) -> None:
        stamps = read_only(self.stamps_ns, "stamps_ns", (None,), np.int64)
        if len(stamps) == 0 or (stamps != np.arange(len(stamps)) * STEP_NS).any():
            raise ValueError(f"stamps_ns must be 0, {STEP_NS}, {2 * STEP_NS}, ...")
        if not len(stamps) == len(self.mav) == len(self.ground):
            raise ValueError("stamps_ns and both robots must have the same length")
        object.__setattr__(self, "stamps_ns", stamps)

    @property
    def duration_s(self) -> float:
        return float(self.stamps_ns[-1]) * 1e-9

    def robot(self, robot: Robot) -> RobotMotion:
        return self.mav if robot == "mav" else self.ground

    def pose(self, robot: Robot, stamp_ns: int) -> SE3:
        """T_world_body at any time from the first stamp to the last.

        Raises:
            ValueError: The time lies outside.
        """
        last = int(self.stamps_ns[-1])
        if not 0 <= stamp_ns <= last:
            raise ValueError(f"stamp {stamp_ns} is outside the motion [0, {last}]")
        index, rest = divmod(int(stamp_ns), STEP_NS)
        return self.robot(robot).pose(index, rest / STEP_NS, STEP_NS * 1e-9)

    def camera_pose(self, robot: Robot, stamp_ns: int) -> SE3:
        """T_world_camera (OpenCV axes) at any time, with the true mounting.

        Raises:
            ValueError: The time lies outside.
        """
        return self.pose(robot, stamp_ns) @ self.robot(robot).mounting.T_body_camera

    def with_camera_moved(self, robot: Robot, T_camera_eye: SE3) -> Motion:
        """The same motion with a robot's camera at another place, given in the camera's frame."""
        states = self.robot(robot)
        mounted = states.mounting
        moved = replace(mounted, T_imu_camera=mounted.T_imu_camera @ T_camera_eye)
        states = replace(states, mounting=moved)
        return replace(self, mav=states) if robot == "mav" else replace(self, ground=states)

    def save(self, path: Path) -> None:
        """Write an `.npz` without pickles; the same motion gives the same bytes."""
        arrays: dict[str, NDArray] = {"format": np.array(_FORMAT), "stamps_ns": self.stamps_ns}
        for name in ROBOTS:
            robot = self.robot(name)
            arrays |= {f"{name}_{key}": getattr(robot, key) for key in ARRAY_NAMES}
            arrays[f"{name}_T_body_imu"] = robot.mounting.T_body_imu.matrix()
            arrays[f"{name}_T_imu_camera"] = robot.mounting.T_imu_camera.matrix()
        with Path(path).open("wb") as file:
            np.savez(file, **arrays)  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: Path) -> Motion:
        """Read what `save` wrote.

        Raises:
            InputError: The file is missing, damaged, or of another format.
        """
        try:
            arrays = read_arrays(path)
            if arrays["format"] != _FORMAT:
                raise ValueError(f"its format is {arrays['format']}, expected {_FORMAT}")
            robots = {name: _robot_from(arrays, name) for name in ROBOTS}
            return cls(stamps_ns=arrays["stamps_ns"], **robots)
        except (*UNREADABLE_ARRAYS, TypeError) as error:
            raise InputError(f"{path}: not a readable motion: {error}") from None
        except KeyError as error:
            raise InputError(f"{path}: not a whole motion: array {error} is missing") from None


def _robot_from(arrays: dict[str, NDArray], name: str) -> RobotMotion:
    return RobotMotion(
        **{key: arrays[f"{name}_{key}"] for key in ARRAY_NAMES},
        mounting=Mounting(
            SE3.from_matrix(arrays[f"{name}_T_body_imu"]),
            SE3.from_matrix(arrays[f"{name}_T_imu_camera"]),
        ),
    )


def simulate_motion(
    world: World, scene: Scene, seed: int, duration_s: float | None = None
) -> Motion:
    """Fly the MAV and drive the ground robot along the scene's paths, varied by the seed.

    The robots touch nothing but the floor: the paths keep them clear of what lies there.
    Where the time is longer than a path, the robot hovers or stands at its end.

    Args:
        world: World, for the height of the floor.
        scene: Scene with the paths.
        seed: Another seed is another flight in another magnetic anomaly; the same seed
            gives the same bytes.
        duration_s: Length of the motion; the scene's if None.

    Raises:
        InputError: The duration is not positive or too short to take off, or a path or
            `ground.stop_at_overlap` is impossible.
    """
    # MuJoCo is needed to simulate, not to read what was simulated.
    from sim.robots.flight import fly, plan_flight
    from sim.robots.ground_robot import drive, floor_under, mounting, plan_drive
    from sim.robots.overlap import driven_path

    length_s = scene.duration_s if duration_s is None else duration_s
    if not (np.isfinite(length_s) and length_s > 0):
        raise InputError(f"duration_s must be positive and finite, got {length_s}")
    stamps_ns = np.arange(round(length_s * RATE_HZ) + 1, dtype=np.int64) * STEP_NS
    times = (stamps_ns * 1e-9).astype(np.float64)
    flight_rng, drive_rng, field_rng = np.random.default_rng(seed).spawn(3)
    half = np.array(scene.room.size_m) / 2
    start = np.array([scene.mav.start])
    start_floor = float(floor_under(world.floor_height, start, "mav.start")[0])
    field = room_field(field_rng, -half, half, start_floor)
    flight = plan_flight(scene.mav, start_floor, times, flight_rng)
    path = scene.ground if scene.ground.stop_at_overlap is None else driven_path(world)
    route = plan_drive(path, world.floor_height, drive_rng)
    return Motion(
        stamps_ns=stamps_ns,
        mav=fly(flight, 1.0 / RATE_HZ, field),
        ground=drive(route, times, mounting(scene.ground), field),
    )
