"""What is true: both cameras, their paths and the scene, under `/truth`.

The frame `world` is laid on the ground robot's map at that robot's first pose and stays there,
so that the drift of its SLAM shows.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import rerun as rr

from airground.core.cloud import Source
from airground.core.events import GroundTracked, MavTracked
from airground.core.messages import RobotCalibration
from airground.core.se3 import SE3
from evaluation.rerun_view.images import pinhole
from evaluation.rerun_view.level import Level, Pace
from evaluation.rerun_view.names import GROUND, ROBOT, TRUTH, WORLD
from evaluation.rerun_view.robots import REDRAWN_HZ, GrowingPath
from evaluation.rerun_view.sensor_stream import SensorStream, transform
from evaluation.runs.onlooker import Seen
from sim.truth import Truth

COLOUR = (255, 60, 200)
THIN_M = 0.004
"""Of a true path: it lies within the estimated one, and shows where they part."""
SCENE = f"{TRUTH}/scene"
SCENE_COLOUR = (190, 186, 178)


class TrueRobots:
    """Both robots where they really are.

    Args:
        stream: To draw on.
        level: How often.
        truth: What is true.
        calibrations: Of the robots, for the frustums' shape.
    """

    def __init__(
        self,
        stream: SensorStream,
        level: Level,
        truth: Truth,
        calibrations: Mapping[Source, RobotCalibration],
    ) -> None:
        self._stream, self._truth = stream, truth
        self._pace = {robot: Pace(level.pose_hz) for robot in Source}
        self._path_pace = {robot: Pace(REDRAWN_HZ) for robot in Source}
        self._paths = {robot: GrowingPath() for robot in Source}
        self._anchored = False
        for robot, calibration in calibrations.items():
            name = ROBOT[robot]
            frames = (_camera_frame(name), f"true_{name}_image")
            stream.put_in_frame(WORLD, f"{TRUTH}/{name}/path")
            lens = pinhole(calibration.camera, 1.0, frames, COLOUR)
            stream.log_always(f"{TRUTH}/{name}/camera", lens)
        self._draw_scene()

    def see(self, seen: Seen) -> None:
        """Draw where a camera was that was tracked; where one was lost, too few would ask."""
        if isinstance(seen.event, GroundTracked) and not self._anchored:
            self._anchor(seen.event.stamp_ns, seen.event.T_ground_camera)
        if isinstance(seen.event, GroundTracked | MavTracked):
            self._draw(seen.frame.robot, seen.event.stamp_ns)

    def _draw(self, robot: Source, stamp_ns: int) -> None:
        name, path = ROBOT[robot], self._paths[robot]
        T_world_camera = self._truth.T_world_camera(
            "mav" if robot == Source.MAV else "ground", stamp_ns
        )
        path.add(stamp_ns, T_world_camera.translation)
        if self._pace[robot].due(stamp_ns):
            placed = transform(T_world_camera, WORLD, _camera_frame(name))
            self._stream.log(stamp_ns, f"{TRUTH}/{name}/camera/pose", placed)
        if self._path_pace[robot].due(stamp_ns):
            self._stream.log(stamp_ns, f"{TRUTH}/{name}/path", path.drawn(COLOUR, THIN_M))

    def _anchor(self, stamp_ns: int, T_ground_camera: SE3) -> None:
        self._anchored = True
        T_world_camera = self._truth.T_world_ground_camera(stamp_ns)
        T_ground_world = T_ground_camera @ T_world_camera.inverse()
        self._stream.log_always(f"{TRUTH}/world", transform(T_ground_world, GROUND, WORLD))

    def _draw_scene(self) -> None:
        mesh = self._truth.mesh
        corners = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        self._stream.put_in_frame(WORLD, SCENE)
        # Triangles that share no corner keep their edges sharp.
        faces = rr.Mesh3D(
            vertex_positions=corners.reshape(-1, 3).astype(np.float32),
            vertex_normals=np.repeat(normals, 3, axis=0).astype(np.float32),
            albedo_factor=SCENE_COLOUR,
        )
        self._stream.log_always(SCENE, faces)


def _camera_frame(name: str) -> str:
    return f"true_{name}_camera"
