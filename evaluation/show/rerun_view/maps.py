"""The ground robot's map, the aerial surfaces, and their alignment."""

from __future__ import annotations

import numpy as np
import rerun as rr

from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.events import Aligned, BeliefUpdated, GroundMapExtended, MapAugmented
from airground.core.messages import GroundImage
from airground.core.se3 import SE3, interpolate
from airground.core.voxel_map import VoxelMap
from evaluation.run.onlooker import Seen
from evaluation.show.figures.landing import eased
from evaluation.show.figures.scene_pictures import GROUND_COLOUR, tinted
from evaluation.show.rerun_view.sensor_stream import (
    GROUND,
    MAV,
    SURFACE,
    Level,
    Pace,
    SensorStream,
    transform,
)

SURFACE_COLOUR = (255, 150, 40)
GLIDE_NS, GLIDE_STEPS = 400_000_000, 8
"""Duration [ns] and steps in which a surface is drawn moving from belief to alignment; alignment
itself takes no sensor time."""
FIRST_STRIDE_PX = 6
"""Stride in a keyframe's depth while there is no fused map: enough points for a viewer."""


class Maps:
    """Clouds of both robots, thinned for the viewer."""

    def __init__(self, stream: SensorStream, level: Level, ground_camera: PinholeCamera) -> None:
        self._stream, self._voxel_m = stream, level.voxel_m
        self._first: FirstKeyframes | None = FirstKeyframes(ground_camera, level.voxel_m)
        self._aerial = VoxelMap(level.voxel_m)
        self._ground_pace, self._aerial_pace = Pace(level.cloud_hz), Pace(level.cloud_hz)
        self._T_ground_surface: SE3 | None = None
        stream.put_in_frame(GROUND, "ground/map")
        stream.put_in_frame(MAV, "mav/map")
        stream.put_in_frame(SURFACE, "mav/surface")

    def see(self, seen: Seen) -> None:
        stamp_ns = seen.event.stamp_ns
        match seen.event:
            case GroundMapExtended() if self._first is not None:
                self._draw_first(seen, stamp_ns, self._first)
            case BeliefUpdated(belief=belief):
                self._draw_ground(seen, stamp_ns)
                self._T_ground_surface = belief.T_ground_mav if belief.converged else None
                self._draw_surface(seen, stamp_ns)
            case Aligned(alignment=alignment) if alignment.accepted:
                self._glide(stamp_ns, alignment.T_ground_mav)
            case MapAugmented():
                self._draw_aerial(seen, stamp_ns)

    def _draw_first(self, seen: Seen, stamp_ns: int, first: FirstKeyframes) -> None:
        image, pose = seen.frame.image, seen.frame.pose
        assert isinstance(image, GroundImage)
        assert pose.T_map_camera is not None
        first.add(image, pose.T_map_camera)
        if self._ground_pace.due(stamp_ns):
            self._stream.log(
                stamp_ns, "ground/map", self._points(first.voxels.cloud(), GROUND_COLOUR)
            )

    def _draw_ground(self, seen: Seen, stamp_ns: int) -> None:
        self._first = None
        if seen.sighting is not None and self._ground_pace.due(stamp_ns):
            cloud = thinned(seen.sighting.ground_cloud, self._voxel_m)
            self._stream.log(stamp_ns, "ground/map", self._points(cloud, GROUND_COLOUR))

    def _draw_surface(self, seen: Seen, stamp_ns: int) -> None:
        """The newest surface as placed by the particles; removed if they did not converge."""
        if self._T_ground_surface is None or seen.sighting is None:
            self._stream.log(stamp_ns, "mav/surface", rr.Clear(recursive=False))
            return
        cloud = thinned(seen.sighting.surface.cloud_mav, self._voxel_m)
        self._place(stamp_ns, SURFACE, self._T_ground_surface)
        self._stream.log(stamp_ns, "mav/surface", self._points(cloud, SURFACE_COLOUR))

    def _glide(self, stamp_ns: int, T_ground_mav: SE3) -> None:
        """Move the surface to the alignment, and the MAV's map at once."""
        start = self._T_ground_surface or T_ground_mav
        for step in range(1, GLIDE_STEPS + 1):
            share = step / GLIDE_STEPS
            then_ns = stamp_ns + round(share * GLIDE_NS)
            self._place(then_ns, SURFACE, interpolate(start, T_ground_mav, eased(share)))
        self._place(stamp_ns, MAV, T_ground_mav)

    def _draw_aerial(self, seen: Seen, stamp_ns: int) -> None:
        """All aerial points so far, from the end of the newest surface's motion on."""
        assert seen.sighting is not None
        cloud = seen.sighting.surface.cloud_mav
        self._aerial.add(cloud.points, cloud.colours)
        if self._aerial_pace.due(stamp_ns):
            points = self._points(self._aerial.cloud(), None)
            self._stream.log(stamp_ns + GLIDE_NS, "mav/map", points)

    def _place(self, stamp_ns: int, frame: str, T_ground_frame: SE3) -> None:
        entity = "mav/surface" if frame == SURFACE else "mav"
        self._stream.log(stamp_ns, f"{entity}/alignment", transform(T_ground_frame, GROUND, frame))

    def _points(self, cloud: PointCloud, tint: tuple[int, int, int] | None) -> rr.Points3D:
        return rr.Points3D(
            cloud.points, colors=tinted(cloud.colours, tint), radii=[0.55 * self._voxel_m]
        )


class FirstKeyframes:
    """The ground robot's depth until its map is first fused, for the MAV's first surface."""

    def __init__(self, camera: PinholeCamera, voxel_m: float) -> None:
        self._rays = camera.rays()[::FIRST_STRIDE_PX, ::FIRST_STRIDE_PX].reshape(-1, 3)
        self.voxels = VoxelMap(voxel_m)

    def add(self, image: GroundImage, T_ground_camera: SE3) -> None:
        depth = image.depth[::FIRST_STRIDE_PX, ::FIRST_STRIDE_PX].ravel()
        colours = image.colour[::FIRST_STRIDE_PX, ::FIRST_STRIDE_PX].reshape(-1, 3)
        known = np.isfinite(depth)
        points = T_ground_camera @ (self._rays[known] * depth[known, None])
        self.voxels.add(points, colours[known])


def thinned(cloud: PointCloud, voxel_m: float) -> PointCloud:
    """One mean point per cube of this side [m]."""
    voxels = VoxelMap(voxel_m)
    voxels.add(cloud.points, cloud.colours)
    return voxels.cloud()
