"""The truth of a recording: written beside it, read only by the evaluator.

`truth/` holds `mav.tum` and `ground.tum` (T_world_body at the IMU's rate), `surface.ply`
(the mesh of all that can be seen), `parts.csv` (what its triangles belong to), `boxes.csv`,
`calibration.toml` (the real one, in the schema of the nominal one) and `motion.npz` (the exact
states). If boxes change before the MAV flies, these files hold what the ground robot sees;
`surface_mav.ply` and `parts_mav.csv` hold what the MAV sees, and `changes.csv` what has changed.
If sensors fail, `faults.csv` lists which, from when to when. Times in these files are those of the
motion, also where a robot's clock has stepped.
Bodies that move are in `bodies.csv` and `body_NAME.tum`, and not in the surface.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import RecordingError
from airground.io.calibration import CalibrationTable, RobotTable
from airground.io.folder_links import check_links
from airground.io.header import parse_table, read_toml, write_toml
from airground.io.layout import TRUTH
from airground.io.lens import Lens
from airground.io.tum import write_tum
from sim.geometry.box import Box
from sim.recording.bodies_truth import BodySurfaces
from sim.recording.faults_file import read_clocks, write_faults
from sim.recording.row_poses import RowPoses, exact_row_poses
from sim.recording.true_surface import TrueSurface
from sim.robots.motion import ROBOTS, Motion, Robot
from sim.robots.moving_bodies import MovingBody, read_bodies, write_bodies
from sim.sensors.faults import Fault
from sim.sensors.robot_clock import RobotClock

if TYPE_CHECKING:
    from sim.geometry.changes import Change
    from sim.world.world import World

_CHANGES = "changes.csv"
"""Its presence says that the MAV sees another surface than the ground robot."""


@dataclass(frozen=True, eq=False)
class Truth:
    """The true motion and calibration, by the recording's nominal stamps."""

    folder: Path
    motion: Motion
    calibration: CalibrationTable

    @classmethod
    def open(cls, recording: Path | str) -> Truth:
        """The truth of the recording in this folder; AirgroundError if missing or damaged."""
        folder = Path(recording) / TRUTH
        if not folder.is_dir():
            raise RecordingError(
                f"{folder}: this recording has no truth (where it is sealed, that is elsewhere)"
            )
        check_links(folder)
        path = folder / "calibration.toml"
        calibration = parse_table(CalibrationTable, read_toml(path), path)
        return cls(folder, Motion.load(folder / "motion.npz"), calibration)

    def T_world_mav_camera(self, stamp_ns: int) -> SE3:
        """The MAV's camera when the image with this stamp was really taken."""
        return self.T_world_camera("mav", stamp_ns)

    def T_world_ground_camera(self, stamp_ns: int) -> SE3:
        """The ground robot's camera when the image with this stamp was really taken."""
        return self.T_world_camera("ground", stamp_ns)

    def T_world_camera(self, robot: Robot, stamp_ns: int) -> SE3:
        """Pose of a camera at a stamp of its robot's clock, which may have stepped, while the
        camera's own runs a little off."""
        with self._posed(robot):
            return self.motion.camera_pose(robot, self.time_ns(robot, stamp_ns))

    def sensors(self, robot: Robot) -> RobotTable:
        return self.calibration.mav if robot == "mav" else self.calibration.ground

    def lens(self, robot: Robot) -> Lens:
        """True intrinsics, distortion and shutter of a camera."""
        return self.sensors(robot).camera.lens()

    def row_poses(self, robot: Robot, stamp_ns: int) -> RowPoses:
        """`T_world_camera` of every row of the image with a stamp [ns]."""
        middle_ns = self.time_ns(robot, stamp_ns)
        with self._posed(robot):
            return exact_row_poses(self.motion, robot, self.lens(robot), middle_ns)

    @contextmanager
    def _posed(self, robot: Robot) -> Iterator[None]:
        """RecordingError where the motion has no pose at a time."""
        try:
            yield
        except ValueError as error:
            raise RecordingError(f"{self.folder}: no true pose of the {robot}: {error}") from None

    def time_ns(self, robot: Robot, stamp_ns: int) -> int:
        """Time of the motion at which an image's middle row was taken [ns]."""
        return self.clock(robot).time_ns(stamp_ns) + self.sensors(robot).camera.time_offset_ns

    def clock(self, robot: Robot) -> RobotClock:
        """The clock of a robot, which stamps all its samples."""
        return self._clocks[robot]

    @cached_property
    def _clocks(self) -> dict[Robot, RobotClock]:
        return read_clocks(self.folder)

    @cached_property
    def bodies(self) -> BodySurfaces:
        """The bodies that move."""
        return BodySurfaces(read_bodies(self.folder))

    def surface(self, robot: Robot) -> TrueSurface:
        """The true surface of the world that a robot sees."""
        return self._surfaces[robot]

    @cached_property
    def _surfaces(self) -> dict[Robot, TrueSurface]:
        seen = _ground_surface(self.folder)
        changed = (self.folder / _CHANGES).exists()
        return {"ground": seen, "mav": _mav_surface(self.folder) if changed else seen}

    def depth(self, robot: Robot, stamp_ns: int) -> NDArray[np.float32]:
        """(height, width) true depth [m] of the frame with this stamp, NaN for nothing: of every
        pixel's own ray, along the optical axis of its row's own pose.
        """
        rays = self.row_poses(robot, stamp_ns).rays_world(self.lens(robot).rays())
        depth = self.surface(robot).scene.cast_rays(rays)["t_hit"].numpy()
        if self.bodies.bodies:
            hits = self.bodies.hits(robot, rays.numpy(), self.time_ns(robot, stamp_ns))
            depth = np.minimum(depth, hits.distance)
        return np.where(np.isfinite(depth), depth, np.float32(np.nan))


def write_truth(
    recording: Path,
    drive: World,
    flight: World,
    motion: Motion,
    calibration: CalibrationTable,
    faults: Sequence[Fault] = (),
    bodies: Sequence[MovingBody] = (),
) -> None:
    """Write `truth/` into a recording's folder.

    Args:
        recording: Folder of the recording.
        drive, flight: Worlds that the ground robot and the MAV see.
        motion: Motion of both robots.
        calibration: True calibration of the sensors.
        faults: Failures of sensors, with their starts.
        bodies: Bodies that move.
    """
    folder = recording / TRUTH
    folder.mkdir()
    write_toml(folder / "calibration.toml", calibration)
    motion.save(folder / "motion.npz")
    for robot in ROBOTS:
        states = motion.robot(robot)
        poses = Trajectory(motion.stamps_ns, states.rotations_world, states.positions_world)
        write_tum(folder / f"{robot}.tum", poses)
    _ground_surface(folder).write(drive)
    _write_boxes(folder / "boxes.csv", drive.boxes)
    write_bodies(folder, bodies)
    if flight.changes:
        _mav_surface(folder).write(flight)
        _write_changes(folder / _CHANGES, flight.changes)
    write_faults(folder, faults)


def _ground_surface(truth: Path) -> TrueSurface:
    return TrueSurface(truth / "surface.ply", truth / "parts.csv")


def _mav_surface(truth: Path) -> TrueSurface:
    return TrueSurface(truth / "surface_mav.ply", truth / "parts_mav.csv")


_SIZE = tuple(f"{name} [m]" for name in ("sx", "sy", "sz"))
_POSE = (*(f"{name} [m]" for name in ("tx", "ty", "tz")), "qx", "qy", "qz", "qw")


def _write_boxes(path: Path, boxes: Sequence[Box]) -> None:
    rows = [[box.name, *_numbers(box.size_m), *_pose(box)] for box in boxes]
    _write_table(path, ["name", *_SIZE, *_POSE], rows)


def _write_changes(path: Path, changes: Sequence[Change]) -> None:
    """Empty cells: the box is gone."""
    columns = [f"{column} {when}" for when in ("before", "after") for column in _POSE]
    rows = [
        [
            change.before.name,
            change.kind,
            *_pose(change.before),
            *(_pose(change.after) if change.after else [""] * len(_POSE)),
        ]
        for change in changes
    ]
    _write_table(path, ["name", "change", *columns], rows)


def _write_table(path: Path, columns: list[str], rows: list[list[str]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([columns, *rows])


def _pose(box: Box) -> list[str]:
    pose = box.T_world_box
    return _numbers([*pose.translation, *pose.quaternion_xyzw()])


def _numbers(values: Iterable[float]) -> list[str]:
    return [f"{value:.9f}" for value in values]
