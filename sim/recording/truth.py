"""The truth of a recording: written beside it, read only by the evaluator.

`truth/` holds `mav.tum` and `ground.tum` (T_world_body at the IMU's rate), `surface.ply`
(the mesh of all that can be seen), `parts.csv` (what its triangles belong to), `boxes.csv`,
`calibration.toml` (the real one, in the schema of the nominal one) and `motion.npz` (the exact
states).
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import RecordingError
from airground.io.calibration import CalibrationTable, RobotTable
from airground.io.header import parse_table, read_toml, write_toml
from airground.io.layout import TRUTH
from airground.io.tum import write_tum
from sim.geometry.parts import write_parts
from sim.robots.motion import ROBOTS, Motion, Robot
from sim.world.world import World


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
            raise RecordingError(f"{folder}: this recording has no truth")
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
        """Pose of a camera at a stamp of its own clock, which runs a little off."""
        offset_ns = self.sensors(robot).camera.time_offset_ns
        return self.motion.camera_pose(robot, stamp_ns + offset_ns)

    def sensors(self, robot: Robot) -> RobotTable:
        return self.calibration.mav if robot == "mav" else self.calibration.ground

    def camera(self, robot: Robot) -> PinholeCamera:
        """True intrinsics."""
        return self.sensors(robot).camera.pinhole()

    @cached_property
    def mesh(self) -> o3d.geometry.TriangleMesh:
        """The true surface, in `world`."""
        path = self.folder / "surface.ply"
        mesh = o3d.io.read_triangle_mesh(path) if path.is_file() else None
        if mesh is None or not mesh.has_triangles():
            raise RecordingError(f"{path}: no readable mesh with triangles")
        vertices, triangles = np.asarray(mesh.vertices), np.asarray(mesh.triangles)
        if not np.isfinite(vertices).all():
            raise RecordingError(f"{path}: a vertex is not finite")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise RecordingError(f"{path}: a triangle has a vertex that is not there")
        return mesh

    @cached_property
    def surface(self) -> o3d.t.geometry.RaycastingScene:
        """The true surface, ready for rays and distances."""
        mesh = self.mesh
        scene = o3d.t.geometry.RaycastingScene()
        vertices = np.asarray(mesh.vertices).astype(np.float32)
        scene.add_triangles(
            o3d.core.Tensor.from_numpy(vertices),
            o3d.core.Tensor.from_numpy(np.asarray(mesh.triangles).astype(np.uint32)),
        )
        return scene

    def distance_to_surface(self, points_world: NDArray) -> NDArray[np.float32]:
        """(N,) distance of points (N, 3) to the nearest point of the true surface [m]."""
        points = np.ascontiguousarray(points_world, dtype=np.float32)
        return self.surface.compute_distance(o3d.core.Tensor.from_numpy(points)).numpy()

    def depth(self, robot: Robot, stamp_ns: int) -> NDArray[np.float32]:
        """(height, width) true depth [m] of the frame with this stamp, NaN for nothing.
        For the true intrinsics; z along the optical axis.
        """
        return self.cast(self.camera(robot), self.T_world_camera(robot, stamp_ns))

    def cast(self, camera: PinholeCamera, T_world_camera: SE3) -> NDArray[np.float32]:
        """(height, width) true depth [m] that any camera would see from anywhere."""
        directions = camera.rays() @ T_world_camera.rotation.T
        origins = np.broadcast_to(T_world_camera.translation, directions.shape)
        rays = np.concatenate([origins, directions], axis=-1).astype(np.float32)
        # Directions have z = 1 in the camera, so that their multiples are depths.
        depth = self.surface.cast_rays(o3d.core.Tensor.from_numpy(rays))["t_hit"].numpy()
        return np.where(np.isfinite(depth), depth, np.float32(np.nan))


def write_truth(
    recording: Path, world: World, motion: Motion, calibration: CalibrationTable
) -> None:
    """Write `truth/` into a recording's folder."""
    folder = recording / TRUTH
    folder.mkdir()
    write_toml(folder / "calibration.toml", calibration)
    motion.save(folder / "motion.npz")
    for robot in ROBOTS:
        states = motion.robot(robot)
        poses = Trajectory(motion.stamps_ns, states.rotations_world, states.positions_world)
        write_tum(folder / f"{robot}.tum", poses)
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(np.array(world.vertices)),
        o3d.utility.Vector3iVector(np.array(world.triangles)),
    )
    if not o3d.io.write_triangle_mesh(folder / "surface.ply", mesh):
        raise OSError(f"{folder / 'surface.ply'}: cannot be written")
    write_parts(folder / "parts.csv", world.parts)
    _write_boxes(folder / "boxes.csv", world)


def _write_boxes(path: Path, world: World) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        sizes, places, turns = ("sx", "sy", "sz"), ("tx", "ty", "tz"), ("qx", "qy", "qz", "qw")
        writer.writerow(["name", *(f"{s} [m]" for s in (*sizes, *places)), *turns])
        for box in world.boxes:
            pose = [*box.size_m, *box.T_world_box.translation, *box.T_world_box.quaternion_xyzw()]
            writer.writerow([box.name, *(f"{value:.9f}" for value in pose)])
