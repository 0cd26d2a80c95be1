"""Estimated and true cameras with their paths, and the true scene."""

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
from evaluation.run.onlooker import Seen
from evaluation.show.rerun_view.images import pinhole
from evaluation.show.rerun_view.sensor_stream import (
    GROUND,
    PATH_COLOUR,
    ROBOT,
    TRUTH,
    TRUTH_COLOUR,
    WORLD,
    Level,
    Pace,
    SensorStream,
    camera_frame,
    transform,
)
from sim.recording.truth import Truth

PATH_RADIUS_M = 0.008
TRUE_RADIUS_M = 0.004
"""Radius of a true path: thin, so that it lies inside the estimated one where both agree."""
STEP_NS = 100_000_000
"""Time between points of a path."""
REDRAWN_HZ = 1.0
"""A path is drawn as a whole, so that its cost grows with the square of its length."""
SCENE = f"{TRUTH}/scene"
SCENE_COLOUR = (190, 186, 178)


class GrowingPath:
    """Positions so far, thinned."""

    def __init__(self) -> None:
        self._stamps_ns: list[int] = []
        self._points: list[NDArray[np.float64]] = []

    def add(self, stamp_ns: int, position: NDArray[np.float64]) -> None:
        if not self._stamps_ns or stamp_ns - self._stamps_ns[-1] >= STEP_NS:
            self._stamps_ns.append(stamp_ns)
            self._points.append(position)

    def follow(self, trajectory: Trajectory) -> None:
        """Move the points to a corrected trajectory; points without a pose in it stay."""
        index = np.searchsorted(trajectory.stamps_ns, self._stamps_ns)
        for at, (stamp, i) in enumerate(zip(self._stamps_ns, index, strict=True)):
            if i < len(trajectory) and trajectory.stamps_ns[i] == stamp:
                self._points[at] = trajectory.translations[i]

    def drawn(
        self, colour: tuple[int, int, int], radius_m: float = PATH_RADIUS_M
    ) -> rr.LineStrips3D:
        points = np.array(self._points, np.float32).reshape(-1, 3)
        return rr.LineStrips3D([points], colors=[colour], radii=[radius_m])


class MovingCamera:
    """A camera and its path, drawn at the rates of a level.
    `frames` are the one that it moves in and its own; `entities` are the camera's and the
    path's."""

    def __init__(
        self,
        stream: SensorStream,
        level: Level,
        frames: tuple[str, str],
        entities: tuple[str, str],
        colour: tuple[int, int, int],
        radius_m: float = PATH_RADIUS_M,
    ) -> None:
        self.path = GrowingPath()
        self._stream, self._frames, self._entities = stream, frames, entities
        self._look = colour, radius_m
        self._pose_pace, self._path_pace = Pace(level.pose_hz), Pace(REDRAWN_HZ)
        stream.put_in_frame(frames[0], entities[1])

    def draw(self, stamp_ns: int, T_frame_camera: SE3) -> None:
        self.path.add(stamp_ns, T_frame_camera.translation)
        if self._pose_pace.due(stamp_ns):
            placed = transform(T_frame_camera, *self._frames)
            self._stream.log(stamp_ns, self._entities[0], placed)
        if self._path_pace.due(stamp_ns):
            self._stream.log(stamp_ns, self._entities[1], self.path.drawn(*self._look))


class Robots:
    """Both cameras and their paths, each in its robot's map."""

    def __init__(self, stream: SensorStream, level: Level) -> None:
        self._cameras = {
            robot: MovingCamera(
                stream,
                level,
                (name, camera_frame(name)),
                (f"{name}/camera", f"{name}/path"),
                PATH_COLOUR[robot],
            )
            for robot, name in ROBOT.items()
        }

    def see(self, seen: Seen) -> None:
        frame = seen.frame
        if isinstance(seen.event, MavTracked | GroundTracked):
            assert frame.pose.T_map_camera is not None
            camera = self._cameras[frame.robot]
            if frame.trajectory is not None:
                camera.path.follow(frame.trajectory)
            camera.draw(frame.stamp_ns, frame.pose.T_map_camera)


class TrueRobots:
    """True cameras with their frustums and paths, and the true scene."""

    def __init__(
        self,
        stream: SensorStream,
        level: Level,
        truth: Truth,
        calibrations: Mapping[Source, RobotCalibration],
    ) -> None:
        self._stream, self._truth = stream, truth
        self._cameras: dict[Source, MovingCamera] = {}
        self._anchored = False
        for robot, calibration in calibrations.items():
            frame, entity = f"true_{ROBOT[robot]}_camera", f"{TRUTH}/{ROBOT[robot]}"
            self._cameras[robot] = MovingCamera(
                stream,
                level,
                (WORLD, frame),
                (f"{entity}/camera/pose", f"{entity}/path"),
                TRUTH_COLOUR,
                TRUE_RADIUS_M,
            )
            frames = frame, f"true_{ROBOT[robot]}_image"
            lens = pinhole(calibration.camera, 1.0, frames, TRUTH_COLOUR)
            stream.log_always(f"{entity}/camera", lens)
        self._draw_scene()

    def see(self, seen: Seen) -> None:
        event = seen.event
        if isinstance(event, GroundTracked) and not self._anchored:
            self._anchored = True
            T_world_camera = self._truth.T_world_ground_camera(event.stamp_ns)
            T_ground_world = event.T_ground_camera @ T_world_camera.inverse()
            self._stream.log_always(f"{TRUTH}/world", transform(T_ground_world, GROUND, WORLD))
        if isinstance(event, GroundTracked | MavTracked):
            robot = seen.frame.robot
            T_world_camera = self._truth.T_world_camera(ROBOT[robot], event.stamp_ns)
            self._cameras[robot].draw(event.stamp_ns, T_world_camera)

    def _draw_scene(self) -> None:
        mesh = self._truth.surface("ground").mesh
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
