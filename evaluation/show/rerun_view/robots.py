"""Where each robot believes to be, its path, and what is true."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from airground.core.cloud import Source
from airground.core.events import GroundTracked, MavTracked
from airground.core.messages import RobotCalibration
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.tracking import TrackedFrame
from evaluation.run.onlooker import Seen
from evaluation.show.rerun_view.images import pinhole
from evaluation.show.rerun_view.sensor_stream import (
    GROUND,
    PATH_COLOUR,
    ROBOT,
    TRUTH,
    WORLD,
    Level,
    Pace,
    SensorStream,
    camera_frame,
    transform,
)
from sim.recording.truth import Truth

PATH_RADIUS_M = 0.008
STEP_NS = 100_000_000
"""Points of a path are this far apart."""
REDRAWN_HZ = 1.0
"""A path is drawn as a whole, so that its cost grows with its square."""


class Robots:
    """Both cameras and their paths, each in its robot's map.

    Args:
        stream: To draw on.
        level: How often.
    """

    def __init__(self, stream: SensorStream, level: Level) -> None:
        self._stream = stream
        self._paths = {robot: GrowingPath() for robot in Source}
        self._pose_pace = {robot: Pace(level.pose_hz) for robot in Source}
        self._path_pace = {robot: Pace(REDRAWN_HZ) for robot in Source}
        for robot in ROBOT.values():
            stream.put_in_frame(robot, f"{robot}/path")

    def see(self, seen: Seen) -> None:
        """Draw the pose of an image that was tracked."""
        if isinstance(seen.event, MavTracked | GroundTracked):
            assert seen.frame.pose.T_map_camera is not None
            self._draw(seen.frame, seen.frame.pose.T_map_camera)

    def _draw(self, frame: TrackedFrame, T_map_camera: SE3) -> None:
        robot, stamp_ns = frame.robot, frame.stamp_ns
        name, path = ROBOT[robot], self._paths[robot]
        if frame.trajectory is not None:
            path.follow(frame.trajectory)
        path.add(stamp_ns, T_map_camera.translation)
        if self._pose_pace[robot].due(stamp_ns):
            placed = transform(T_map_camera, name, camera_frame(name))
            self._stream.log(stamp_ns, f"{name}/camera", placed)
        if self._path_pace[robot].due(stamp_ns):
            self._stream.log(stamp_ns, f"{name}/path", path.drawn(PATH_COLOUR[robot]))


class GrowingPath:
    """Positions so far, thinned."""

    def __init__(self) -> None:
        self._stamps_ns: list[int] = []
        self._points: list[NDArray[np.float64]] = []

    def add(self, stamp_ns: int, position: NDArray[np.float64]) -> None:
        """Go on to here."""
        if not self._stamps_ns or stamp_ns - self._stamps_ns[-1] >= STEP_NS:
            self._stamps_ns.append(stamp_ns)
            self._points.append(position)

    def follow(self, trajectory: Trajectory) -> None:
        """The way so far was another one; points that it does not tell of stay."""
        index = np.searchsorted(trajectory.stamps_ns, self._stamps_ns)
        for at, (stamp, i) in enumerate(zip(self._stamps_ns, index, strict=True)):
            if i < len(trajectory) and trajectory.stamps_ns[i] == stamp:
                self._points[at] = trajectory.translations[i]

    def drawn(
        self, colour: tuple[int, int, int], radius_m: float = PATH_RADIUS_M
    ) -> rr.LineStrips3D:
        """As one line."""
        points = np.array(self._points, np.float32).reshape(-1, 3)
        return rr.LineStrips3D([points], colors=[colour], radii=[radius_m])


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
