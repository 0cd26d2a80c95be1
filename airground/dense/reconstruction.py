"""Dense monocular reconstruction (Sec. V): posed images in, fused surfaces out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from airground.config import Config
from airground.core.arrays import U8, U32
from airground.core.camera import PinholeCamera
from airground.core.events import (
    DepthMapMade,
    Event,
    FieldAdded,
    FrameAdded,
    SurfaceCast,
    VolumeFused,
)
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface, DepthMap
from airground.dense.depth_refinement import depth_from_costs
from airground.dense.distance_field import MAX_DEPTH_MAPS, FieldHistogram
from airground.dense.fusion import Fusion
from airground.dense.plane_sweep import PlaneSweep, Workspace, inverse_depth_planes
from airground.dense.ray_casting import cast_surface, surface_cloud
from airground.dense.scene_extent import scene_extent
from airground.dense.view_selection import AFTER, BEFORE, PosedImage, ViewBuffer, ViewSet
from airground.dense.volume import Volume

MAX_OPEN = 4
"""Most depth maps under construction at a time: no path of a MAV overlaps more."""


class DenseReconstruction:
    """Turns the MAV's posed images into surfaces.

    Frames near a reference view are compared with it until the camera has left the radius; then
    the depth map is made. Depth maps near the first of a surface are collected until one lies
    outside; then they are fused and cast into the view in their middle."""

    def __init__(self, camera: PinholeCamera, config: Config) -> None:
        self.camera = camera
        self.config = config
        self._recent = ViewBuffer(config.view_selection)
        self._last_reference: PosedImage | None = None
        self._open: list[tuple[ViewSet, PlaneSweep]] = []
        self._workspace = Workspace()
        self._depth_maps: list[DepthMap] = []
        self._fusion = Fusion(
            config.fusion.data_weight, config.fusion.iterations, config.fusion.bins
        )
        self._counts: U32 | None = None
        self._newest_ns = 0

    def reserve(self) -> None:
        """Take the memory of fusion from the system before the first image arrives: on a virtual
        machine that takes half a second, by which the first surface would be late."""
        columns, rows, planes = self.config.fusion.voxels
        self._counts = np.empty((rows, planes, columns), np.uint32)
        self._counts.fill(0)
        self._fusion.reserve(self._counts.shape)

    def add(
        self,
        stamp_ns: int,
        image: U8,
        T_mav_camera: SE3,
        depth_range: tuple[float, float] | None = None,
    ) -> Iterator[Event]:
        """Take in one frame; yields the events that follow.

        Args:
            stamp_ns: Stamp of the image [ns].
            image: (height, width) grey image; ValueError for another size than the camera's.
            T_mav_camera: Pose of the camera in the MAV's map.
            depth_range: Nearest and farthest point of SLAM's sparse map in the image [m]
                (Sec. VIII-B); None where unknown.
        """
        if image.shape != (self.camera.height, self.camera.width):
            raise ValueError(
                f"image at {stamp_ns} is {image.shape[1]}x{image.shape[0]}, "
                f"the camera {self.camera.width}x{self.camera.height}"
            )
        self._newest_ns = stamp_ns
        frame = PosedImage(stamp_ns, image, T_mav_camera)
        for views, sweep in self._open:
            if views.offer(frame):
                sweep.add(image, T_mav_camera, self._side(AFTER))
                yield FrameAdded(stamp_ns, views.reference.stamp_ns)
        yield from self._finish([views for views, _ in self._open if views.complete])
        yield from self._begin(frame, depth_range)
        self._recent.push(frame)

    def flush(self) -> Iterator[Event]:
        """The recording is over: yields what the frames so far still give."""
        yield from self._finish([views for views, _ in self._open])
        yield from self._fuse()

    def _side(self, side: int) -> int:
        return side if self.config.view_selection.both_sides else 0

    def _begin(self, frame: PosedImage, depth_range: tuple[float, float] | None) -> Iterator[Event]:
        """Makes the frame a reference view if the last is far enough behind."""
        selection = self.config.view_selection
        last = self._last_reference
        if last is not None and frame.distance(last) < selection.depth_map_spacing_m:
            return
        before = self._recent.around(frame)
        if not before or max(map(frame.baseline, before)) < selection.min_baseline_m:
            return
        extent = scene_extent(frame, before, self.camera, depth_range)
        if extent is None or extent.near_m < selection.min_depth_m:
            return
        self._last_reference = frame
        views = ViewSet(frame, selection)
        planes = inverse_depth_planes(
            extent.near_m, extent.far_m, self.config.plane_sweep.hypotheses
        )
        sides = 2 if selection.both_sides else 1
        sweep = PlaneSweep(
            frame.image,
            self.camera,
            frame.T_mav_camera,
            planes,
            self.config.plane_sweep,
            sides,
            self._workspace,
        )
        for _, abandoned in self._open[: 1 - MAX_OPEN]:
            abandoned.release()
        self._open = [*self._open[-(MAX_OPEN - 1) :], (views, sweep)]
        if selection.both_sides:
            for view in reversed(before):
                if views.offer(view):
                    sweep.add(view.image, view.T_mav_camera, BEFORE)
                    yield FrameAdded(view.stamp_ns, frame.stamp_ns)

    def _finish(self, finished: list[ViewSet]) -> Iterator[Event]:
        """Makes the depth maps whose views are all there."""
        for views, sweep in [pair for pair in self._open if pair[0] in finished]:
            self._open = [pair for pair in self._open if pair[0] is not views]
            if not views.suffices():
                sweep.release()
                continue
            depth = depth_from_costs(sweep, self.config.plane_sweep)
            depth_map = DepthMap(
                views.reference.stamp_ns,
                sweep.camera,
                sweep.T_mav_camera,
                depth,
                np.round(sweep.reference).astype(np.uint8),
                sweep.views,
            )
            sweep.release()
            yield DepthMapMade(self._newest_ns, depth_map)
            if self._leaves_surface(depth_map):
                yield from self._fuse()
            self._depth_maps.append(depth_map)

    def _leaves_surface(self, depth_map: DepthMap) -> bool:
        if not self._depth_maps:
            return False
        first = self._depth_maps[0].T_mav_camera.translation
        distance = float(np.linalg.norm(depth_map.T_mav_camera.translation - first))
        return (
            distance > self.config.view_selection.fusion_radius_m
            or len(self._depth_maps) >= MAX_DEPTH_MAPS
        )

    def _fuse(self) -> Iterator[Event]:
        """Fuses the collected depth maps and casts the surface (Eq. 1)."""
        depth_maps, self._depth_maps = self._depth_maps, []
        parameters = self.config.fusion
        depth_maps = [one for one in depth_maps if np.isfinite(one.depth).any()]
        if len(depth_maps) < parameters.min_depth_maps:
            return
        reference = depth_maps[len(depth_maps) // 2]
        volume = Volume.around(depth_maps, reference, parameters.voxels, parameters.truncation_m)
        histogram = FieldHistogram(volume, parameters.truncation_m, parameters.bins, self._counts)
        self._counts = histogram.counts
        for depth_map in depth_maps:
            histogram.add(depth_map)
            yield FieldAdded(self._newest_ns, depth_map.stamp_ns)
        phi = self._fusion.fuse(histogram.counts)
        yield VolumeFused(self._newest_ns)
        depth, normals = cast_surface(
            volume,
            phi,
            histogram.counts,
            parameters.min_observations,
            parameters.truncation_m,
            parameters.bins,
        )
        surface = AerialSurface(
            self._newest_ns,
            reference.stamp_ns,
            volume.camera,
            volume.T_mav_camera,
            depth,
            surface_cloud(volume, depth, normals, reference),
            len(depth_maps),
        )
        yield SurfaceCast(self._newest_ns, surface)
