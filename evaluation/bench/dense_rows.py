"""Work on images and distance fields: Section V, the ground map and decoding."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from airground.config import Config, paper
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.surface import DepthMap
from airground.dense.depth_refinement import depth_from_costs
from airground.dense.distance_field import MAX_DEPTH_MAPS, FieldHistogram
from airground.dense.fusion import Fusion
from airground.dense.plane_sweep import PlaneSweep, Workspace, inverse_depth_planes
from airground.dense.ray_casting import cast_surface, surface_cloud
from airground.dense.scene_extent import scene_extent
from airground.dense.view_selection import AFTER, BEFORE, PosedImage
from airground.dense.volume import Volume
from airground.ground_map import GroundMap
from airground.ground_map.surface_points import surface_points
from evaluation.bench import floors
from evaluation.bench.material import Material
from evaluation.bench.work import Work

DECODED = 60
"""Images read in turn: some tens of MB, which the system keeps in memory."""


class Sweep:
    """One depth map under construction, view after view in order of time, as the pipeline does.
    `depth_range` is that of the scene before the reference [m]."""

    def __init__(
        self,
        camera: PinholeCamera,
        reference: PosedImage,
        views: list[PosedImage],
        config: Config,
        depth_range: tuple[float, float],
    ) -> None:
        self.depth_range = depth_range
        before = [view for view in views if view.stamp_ns < reference.stamp_ns]
        # The first views may be close together, and then do not show how deep the scene is.
        extent = scene_extent(reference, before or views, camera, depth_range)
        assert extent is not None
        self.camera, self.reference, self.views, self.config = camera, reference, views, config
        self.sides = 2 if config.view_selection.both_sides else 1
        # A depth map has half of the image's width and height.
        self.pixels = (camera.width // 2) * (camera.height // 2)
        self.planes = config.plane_sweep.hypotheses
        self.size = f"{camera.width} x {camera.height} px, {self.planes} hypotheses"
        self._inverse_depths = inverse_depth_planes(extent.near_m, extent.far_m, self.planes)
        self._workspace = Workspace()
        self._sweep: PlaneSweep | None = None
        self._added = 0

    def begin(self) -> None:
        """Begin a new depth map in the memory of the one before."""
        if self._sweep is not None:
            self._sweep.release()
        self._sweep = PlaneSweep(
            self.reference.image,
            self.camera,
            self.reference.T_mav_camera,
            self._inverse_depths,
            self.config.plane_sweep,
            self.sides,
            self._workspace,
        )
        self._added = 0

    def make_ready(self) -> None:
        """Begin a new depth map if all views are in."""
        if self._sweep is None or self._added == len(self.views):
            self.begin()

    def add_next(self) -> None:
        """Compare the next view with the reference."""
        assert self._sweep is not None
        view = self.views[self._added]
        side = AFTER if view.stamp_ns > self.reference.stamp_ns and self.sides == 2 else BEFORE
        self._sweep.add(view.image, view.T_mav_camera, side)
        self._added += 1

    def complete(self) -> PlaneSweep:
        self.begin()
        for _ in self.views:
            self.add_next()
        assert self._sweep is not None
        return self._sweep


def sweep_of(material: Material, config: Config) -> Sweep:
    views = material.reference, material.views
    return Sweep(material.mav_camera, *views, config, material.depth_range())


def with_paper_planes(config: Config) -> Config:
    """The same pipeline with as many depth planes as Table I was measured with."""
    planes = {"hypotheses": paper().plane_sweep.hypotheses}
    return config.model_copy(update={"plane_sweep": config.plane_sweep.model_copy(update=planes)})


def add_frame(material: Material) -> Work:
    sweep = sweep_of(material, with_paper_planes(material.config))
    floor = floors.add_frame(sweep.pixels, sweep.planes)
    return Work(sweep.add_next, sweep.make_ready, sweep.size, floor)


def depth_map(material: Material) -> Work:
    sweep = sweep_of(material, with_paper_planes(material.config))
    parameters = sweep.config.plane_sweep
    finished = sweep.complete()
    floor = floors.depth_map(
        sweep.pixels, parameters.hypotheses, sweep.sides, parameters.smoothing == "semiglobal"
    )
    size = f"{sweep.size}, {len(sweep.views)} views"
    return Work(lambda: depth_from_costs(finished, parameters), size=size, floor=floor)


class VoxelWork:
    """The volume of one surface and what is computed in it, with memory kept between calls."""

    def __init__(self, depth_maps: list[DepthMap], config: Config) -> None:
        self.depth_maps, self.parameters = depth_maps, config.fusion
        self.reference = depth_maps[len(depth_maps) // 2]
        nx, ny, nz = self.parameters.voxels
        self.voxels, self.pixels = nx * ny * nz, nx * ny
        self.size = f"{nx} x {ny} x {nz} voxels"
        self._fusion = Fusion(
            self.parameters.data_weight, self.parameters.iterations, self.parameters.bins
        )
        self._counts: NDArray[np.uint32] | None = None
        self._histogram = self._empty(self._volume())

    def make_room(self) -> None:
        """Empty the histogram if it is full."""
        if self._histogram.depth_maps >= MAX_DEPTH_MAPS:
            self._histogram = self._empty(self._histogram.volume)

    def add_one(self) -> None:
        """The distance field of a depth map, another one each time."""
        self._histogram.add(self.depth_maps[self._histogram.depth_maps % len(self.depth_maps)])

    def add_all(self) -> None:
        self._histogram = self._empty(self._volume())
        for depth_map in self.depth_maps:
            self._histogram.add(depth_map)

    def fuse(self) -> NDArray[np.float32]:
        return self._fusion.fuse(self._histogram.counts)

    def cast(self, phi: NDArray[np.float32]) -> PointCloud:
        """The points of the fused surface."""
        volume, parameters = self._histogram.volume, self.parameters
        depth, normals = cast_surface(
            volume,
            phi,
            self._histogram.counts,
            parameters.min_observations,
            parameters.truncation_m,
            parameters.bins,
        )
        return surface_cloud(volume, depth, normals, self.reference)

    def all_of_it(self) -> PointCloud:
        self.add_all()
        return self.cast(self.fuse())

    def _volume(self) -> Volume:
        parameters = self.parameters
        return Volume.around(
            self.depth_maps, self.reference, parameters.voxels, parameters.truncation_m
        )

    def _empty(self, volume: Volume) -> FieldHistogram:
        """A new histogram in the memory of the old one."""
        parameters = self.parameters
        histogram = FieldHistogram(volume, parameters.truncation_m, parameters.bins, self._counts)
        self._counts = histogram.counts
        return histogram


def distance_field(material: Material) -> Work:
    work = VoxelWork(material.depth_maps, material.config)
    return Work(work.add_one, work.make_room, work.size, floors.distance_field(work.voxels))


def fusion(material: Material) -> Work:
    work = VoxelWork(material.depth_maps, material.config)
    work.add_all()
    parameters = work.parameters
    floor = floors.fusion(work.voxels, parameters.iterations, parameters.bins)
    return Work(work.fuse, size=f"{work.size}, {parameters.iterations} iterations", floor=floor)


def ray_cast(material: Material) -> Work:
    work = VoxelWork(material.depth_maps, material.config)
    work.add_all()
    phi = work.fuse()
    floor = floors.ray_cast(work.voxels, work.pixels)
    return Work(lambda: work.cast(phi), size=work.size, floor=floor)


def surface(material: Material) -> Work:
    """Fields, fusion and casting of one surface, which other libraries do in one step."""
    work = VoxelWork(material.depth_maps, material.config)
    parameters, count = work.parameters, len(work.depth_maps)
    floor = floors.distance_field(work.voxels) * count
    floor += floors.fusion(work.voxels, parameters.iterations, parameters.bins)
    floor += floors.ray_cast(work.voxels, work.pixels)
    return Work(work.all_of_it, size=f"{work.size}, {count} depth maps", floor=floor)


def ground_map(material: Material) -> Work:
    """One keyframe: packed, and fused into the distance field."""
    image, pose = material.ground_image, material.sighting.T_ground_camera
    built = GroundMap(material.ground_camera, material.config.ground_mapping)
    height, width = image.depth.shape
    return Work(lambda: built.add(image, pose), size=f"{width} x {height} px")


def ground_surface(material: Material) -> Work:
    """The ground map's points, colours and normals from its distance field."""
    field = material.ground_field
    least = material.config.ground_mapping.min_keyframes - 0.5
    points = len(surface_points(field, least))
    return Work(
        lambda: surface_points(field, least),
        size=f"{len(field.rows)} blocks, {points} points",
        floor=floors.ground_surface(field.tsdf.size, points),
    )


def read_grey(material: Material) -> Work:
    recording = material.recording
    camera = material.mav_camera
    read = _in_turn(recording.mav.read_image, len(recording.mav.camera_stamps))
    return Work(read, size=f"{camera.width} x {camera.height} px, grey PNG")


def read_colour_depth(material: Material) -> Work:
    recording = material.recording
    camera = material.ground_camera
    read = _in_turn(recording.ground.read_image, len(recording.ground.camera_stamps))
    return Work(read, size=f"{camera.width} x {camera.height} px, colour and depth PNG")


def _in_turn(read: Callable[[int], object], count: int) -> Callable[[], object]:
    indices = itertools.cycle(range(0, count, max(1, count // DECODED)))
    return lambda: read(next(indices))
