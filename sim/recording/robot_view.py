"""What one robot's camera sees through its lens and shutter, before the sensor's faults."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.io.lens import Lens
from sim.geometry.edges import Edges
from sim.recording.bodies_in_view import BodiesInView
from sim.recording.drone_shadow import DroneShadow
from sim.recording.render import Renderer
from sim.recording.resample import places_in_view, resampled
from sim.recording.row_poses import RowPoses, strip_poses
from sim.recording.smooth_edges import smooth_edges
from sim.recording.view_tiles import Tile, is_plain, tiles_of
from sim.robots.motion import Motion, Robot
from sim.robots.moving_bodies import MovingBody

Drawn = tuple[NDArray[np.uint8], NDArray[np.float32]]
"""(height, width, channels) picture, and (height, width) depth [m]."""


@dataclass(frozen=True, eq=False)
class _Moving:
    """Edges of the bodies, and place of the MAV [m] if it throws a shadow, at one time."""

    edges: list[Edges]
    mav: NDArray[np.float64] | None


class RobotView:
    """Draws one robot's images from the stored motion.

    Args:
        lens: True lens and shutter.
        renderer: World with the cameras of `tiles_of` this lens.
        edges: Edges of all visible meshes.
        grey: Whether pictures have one channel in place of three.
        bodies: Bodies of the recording, which the renderer's world holds.
        shadow: The MAV's shadow, if it throws one.
        name: Name of the camera's views in the world, if it is not the robot's.
    """

    def __init__(
        self,
        robot: Robot,
        lens: Lens,
        motion: Motion,
        renderer: Renderer,
        edges: Edges,
        grey: bool,
        bodies: Sequence[MovingBody] = (),
        shadow: DroneShadow | None = None,
        name: str | None = None,
    ) -> None:
        self._robot, self._lens, self._motion = robot, lens, motion
        self._renderer, self._edges, self._grey = renderer, edges, grey
        self._shadow = shadow
        self._bodies = BodiesInView(robot, bodies)
        self._tiles = tiles_of(name or robot, lens)
        self._rays = None if is_plain(lens) else lens.rays()

    def draw(self, time_ns: int) -> Drawn:
        """The image whose middle row is taken at a time of the motion [ns].
        Depth is along the optical axis of each row's own pose, NaN where there is nothing.
        Bodies are where they are at that time, in all rows."""
        self._bodies.place(self._renderer, time_ns)
        moving = self._moving_at(time_ns)
        if self._rays is None:
            return self._view(
                self._tiles[0], self._motion.camera_pose(self._robot, time_ns), moving
            )
        channels = 1 if self._grey else 3
        picture = np.empty((self._lens.height, self._lens.width, channels), np.uint8)
        depth = np.empty(picture.shape[:2], np.float32)
        for tile in self._tiles:
            place = tile.rows, tile.columns
            picture[place], depth[place] = self._tile(tile, self._rays[place], time_ns, moving)
        return picture, depth

    def _moving_at(self, time_ns: int) -> _Moving:
        mav = None if self._shadow is None else self._motion.pose("mav", time_ns).translation
        return _Moving(self._bodies.edges(time_ns), mav)

    def depth(self, time_ns: int) -> NDArray[np.float32]:
        """The depth that `draw` returns, without its picture."""
        self._bodies.place(self._renderer, time_ns)
        if self._rays is None:
            pose = self._motion.camera_pose(self._robot, time_ns)
            return self._renderer.depth(self._tiles[0].name, pose)
        depth = np.empty((self._lens.height, self._lens.width), np.float32)
        for tile in self._tiles:
            place = tile.rows, tile.columns
            T_world_view, poses = self._poses(tile, time_ns)
            seen = self._renderer.depth(tile.name, T_world_view)
            _, depth[place] = places_in_view(self._rays[place], poses, seen, tile.camera)
        return depth

    def _tile(self, tile: Tile, rays: NDArray[np.float64], time_ns: int, moving: _Moving) -> Drawn:
        T_world_view, poses = self._poses(tile, time_ns)
        picture, depth = self._view(tile, T_world_view, moving)
        places, found = places_in_view(rays, poses, depth, tile.camera)
        return resampled(picture, places), found

    def _poses(self, tile: Tile, time_ns: int) -> tuple[SE3, RowPoses]:
        """`T_world_view` of a tile, and the poses of its rows in that frame."""
        T_world_strip, poses = strip_poses(
            self._motion, self._robot, self._lens, time_ns, tile.rows
        )
        T_camera_view = tile.T_camera_view
        return T_world_strip @ T_camera_view, poses.seen_from(T_camera_view)

    def _view(self, tile: Tile, T_world_view: SE3, moving: _Moving) -> Drawn:
        """One pinhole view, with smooth edges."""
        picture, depth = self._renderer.draw(tile.name, T_world_view)
        if self._grey:
            picture = np.asarray(cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY), np.uint8)[..., None]
        for edges in (self._edges, *moving.edges):
            picture = smooth_edges(picture, depth, tile.camera, T_world_view, edges)
        if self._shadow is not None and moving.mav is not None:
            picture = self._shadow.cast(picture, depth, tile.camera, T_world_view, moving.mav)
        return picture, depth
