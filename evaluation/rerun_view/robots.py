"""Where each robot believes to be, and the way that it came."""

from __future__ import annotations

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from airground.core.cloud import Source
from airground.core.events import GroundTracked, MavTracked
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.tracking import TrackedFrame
from evaluation.rerun_view.level import Level, Pace
from evaluation.rerun_view.names import ROBOT, camera_frame
from evaluation.rerun_view.sensor_stream import SensorStream, transform
from evaluation.runs.onlooker import Seen
from evaluation.showcase.scene_pictures import GROUND_PATH, MAV_PATH

PATH_COLOUR = {Source.GROUND: GROUND_PATH, Source.MAV: MAV_PATH}
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
