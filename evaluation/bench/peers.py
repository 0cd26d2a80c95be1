"""The same work by other libraries, on the same data.
Each peer is used as its documentation shows, with every core that it takes by itself. The table at
the end says where it does less or more than ours."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.config import paper
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.core.surface import DepthMap
from airground.dense.plane_sweep import halved, inverse_depth_planes
from airground.dense.scene_extent import scene_extent
from airground.dense.volume import Volume
from airground.ground_map.blocked_field import ATTRIBUTES, BLOCK, empty_grid
from evaluation.bench.dense_rows import with_paper_planes
from evaluation.bench.localization_rows import Maps, paper_sized, start_of
from evaluation.bench.material import Material
from evaluation.bench.work import Work

FIRST_BLOCKS = 20_000
"""Blocks that Open3D's grids have room for at first: enough for one surface."""
NEIGHBOURS = 10
"""Points that a normal is estimated from, as in ours."""
Reach = tuple[float, float, float]
"""Scale of depth, largest depth [m], truncation [voxels]."""


@dataclass(frozen=True)
class Peer:
    """The work of a row by another library; `package` need not be installed, and may be empty."""

    name: str
    make: Callable[[Material], Work]
    differs: str
    package: str = ""


def masked_correlation(material: Material) -> Work:
    """scikit-image: normalized correlation of masked images (Padfield 2012), and its peak."""
    from skimage.registration import phase_cross_correlation

    maps = Maps(material, paper_sized())
    ground, ground_mask = _filled(maps.ground.heights)
    aerial, aerial_mask = _filled(maps.aerial.heights)

    def register() -> object:
        return phase_cross_correlation(
            ground,
            aerial,
            reference_mask=ground_mask,
            moving_mask=aerial_mask,
            overlap_ratio=maps.config.localization.min_overlap,
        )

    return Work(register)


def match_template(material: Material) -> Work:
    """OpenCV: the aerial map, masked, as a template on the ground map."""
    maps = Maps(material, paper_sized())
    ground, _ = _filled(maps.ground.heights)
    aerial, mask = _filled(maps.aerial.heights)
    weight = mask.astype(np.float32)
    return Work(lambda: cv2.matchTemplate(ground, aerial, cv2.TM_CCOEFF_NORMED, mask=weight))


def _filled(heights: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Heights with their mean in holes, and which cells are no holes."""
    known = np.isfinite(heights)
    return np.where(known, heights, heights[known].mean()).astype(np.float32), known


def plane_by_plane(material: Material) -> Work:
    """OpenCV: warp the view by each plane's homography, difference, truncate, add."""
    config = with_paper_planes(material.config).plane_sweep
    camera = material.mav_camera
    small = camera.halved()
    reference, view = material.reference, material.views[-1]
    extent = scene_extent(reference, material.views, camera)
    assert extent is not None
    T_view_reference = view.T_mav_camera.inverse() @ reference.T_mav_camera
    K, inverse = small.matrix(), np.linalg.inv(small.matrix())
    normal = np.array([0.0, 0.0, 1.0])
    homographies = [
        K
        @ (T_view_reference.rotation + np.outer(T_view_reference.translation, normal) / z)
        @ inverse
        for z in inverse_depth_planes(extent.near_m, extent.far_m, config.hypotheses)
    ]
    grey = halved(reference.image)
    size = small.width, small.height
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    costs = np.zeros((config.hypotheses, small.height, small.width), np.float32)

    def add() -> None:
        image = halved(view.image)
        for plane, homography in enumerate(homographies):
            warped = cv2.warpPerspective(image, homography, size, flags=flags)
            difference = np.minimum(cv2.absdiff(warped, grey), np.float32(config.truncation))
            cv2.accumulate(difference, costs[plane])

    return Work(add)


def integrate_one(material: Material) -> Work:
    """Open3D: one depth map into a truncated signed distance field of hashed blocks."""
    grid, reach = _surface_grid(material)
    return Work(lambda: _integrate_depth_map(grid, material.reference_depth, reach))


def integrate_and_extract(material: Material) -> Work:
    """Open3D: all depth maps of a surface, then its points.
    Not `ray_cast`: on a new grid of Open3D 0.20 its first call allocates too little, and finds no
    surface."""

    def build() -> object:
        grid, reach = _surface_grid(material)
        for depth_map in material.depth_maps:
            _integrate_depth_map(grid, depth_map, reach)
        return grid.extract_point_cloud(material.config.fusion.min_observations - 0.5)

    return Work(build)


def _surface_grid(material: Material) -> tuple[o3d.t.geometry.VoxelBlockGrid, Reach]:
    """Open3D's distance field with voxels as wide as ours are in the middle of the volume."""
    fusion = material.config.fusion
    volume = Volume.around(
        material.depth_maps, material.reference_depth, fusion.voxels, fusion.truncation_m
    )
    voxel_m = 0.5 * (volume.near_m + volume.far_m) / volume.camera.fx
    grid = o3d.t.geometry.VoxelBlockGrid(
        attr_names=("tsdf", "weight"),
        attr_dtypes=(o3d.core.float32,) * 2,
        attr_channels=[o3d.core.SizeVector([1])] * 2,
        voxel_size=voxel_m,
        block_resolution=BLOCK,
        block_count=FIRST_BLOCKS,
    )
    return grid, (1.0, volume.far_m + 1.0, fusion.truncation_m / voxel_m)


def _integrate_depth_map(
    grid: o3d.t.geometry.VoxelBlockGrid, depth_map: DepthMap, reach: Reach
) -> None:
    _integrate(grid, depth_map.camera, depth_map.T_mav_camera, reach, depth_map.depth)


def fuse_keyframe(material: Material) -> Work:
    """Open3D: a colour and depth image into a distance field of hashed blocks."""
    image, config = material.ground_image, material.config.ground_mapping
    grid = empty_grid(config.voxel_m, FIRST_BLOCKS)
    reach = (1.0, config.max_depth_m, config.truncation_m / config.voxel_m)

    def fuse() -> None:
        levels = image.colour.astype(np.float32)
        colour = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(levels))
        pose = material.sighting.T_ground_camera
        _integrate(grid, material.ground_camera, pose, reach, image.depth, colour)

    return Work(fuse)


def _integrate(
    grid: o3d.t.geometry.VoxelBlockGrid,
    camera: PinholeCamera,
    T_map_camera: SE3,
    reach: Reach,
    depth: NDArray[np.float32],
    colour: o3d.t.geometry.Image | None = None,
) -> None:
    """Integrate an image with depth [m], NaN where missing, with or without its colours."""
    image = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(np.nan_to_num(depth, nan=0.0)))
    intrinsics = o3d.core.Tensor.from_numpy(camera.matrix())
    extrinsics = o3d.core.Tensor.from_numpy(T_map_camera.inverse().matrix())
    blocks = grid.compute_unique_block_coordinates(image, intrinsics, extrinsics, *reach)
    if colour is None:
        grid.integrate(blocks, image, intrinsics, extrinsics, *reach)
    else:
        grid.integrate(blocks, image, colour, intrinsics, extrinsics, *reach)


def extract_ground(material: Material) -> Work:
    """Open3D: the points of its own voxel block grid, which holds the same field."""
    field = material.ground_field
    grid = empty_grid(field.voxel_m, FIRST_BLOCKS)
    rows, _ = grid.hashmap().activate(o3d.core.Tensor.from_numpy(field.places))
    filled = field.tsdf[..., None], field.weight[..., None], field.colour
    for name, values in zip(ATTRIBUTES, filled, strict=True):
        grid.attribute(name).numpy()[rows.numpy()] = values[field.rows]
    least = material.config.ground_mapping.min_keyframes - 0.5
    return Work(lambda: grid.extract_point_cloud(least))


def open3d_icp(material: Material) -> Work:
    """Open3D: crop, thin and estimate normals, then point-to-plane ICP from the same start."""
    settings = paper().refinement
    registration = o3d.pipelines.registration
    aerial, ground = _cloud(material.surface.cloud_mav), _cloud(material.ground_cloud)
    start = start_of(material).matrix()
    criteria = registration.ICPConvergenceCriteria(max_iteration=settings.iterations)
    knn = o3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS)

    def align() -> object:
        source = aerial.voxel_down_sample(settings.voxel_m)
        box = o3d.geometry.PointCloud(source).transform(start).get_axis_aligned_bounding_box()
        low, high = box.get_min_bound(), box.get_max_bound()
        margin = np.full(3, settings.max_distance_m)
        box = o3d.geometry.AxisAlignedBoundingBox(low - margin, high + margin)
        target = ground.crop(box).voxel_down_sample(settings.voxel_m)
        target.estimate_normals(knn)
        return registration.registration_icp(
            source,
            target,
            settings.max_distance_m,
            start,
            registration.TransformationEstimationPointToPlane(),
            criteria,
        )

    return Work(align)


def _cloud(cloud: PointCloud) -> o3d.geometry.PointCloud:
    points = o3d.utility.Vector3dVector(cloud.points.astype(np.float64))
    return o3d.geometry.PointCloud(points)


PEERS = {
    "ground_map": (
        Peer(
            "Open3D",
            fuse_keyframe,
            "half a pixel off, beside jumps in depth too; no image is kept to fuse anew",
        ),
    ),
    "ground_surface": (
        Peer(
            "Open3D",
            extract_ground,
            "in no lasting order, and without a surface that lies on voxels exactly",
        ),
    ),
    "add_frame": (
        Peer(
            "OpenCV, plane by plane",
            plane_by_plane,
            "samples the view halved, so blurred; no gain, no record of what is covered",
        ),
    ),
    "distance_field": (
        Peer("Open3D TSDF", integrate_one, "a running mean near the surface only, no histogram"),
    ),
    "surface": (
        Peer(
            "Open3D TSDF",
            integrate_and_extract,
            "a running mean, no regularization; every crossing, not only what the view sees",
        ),
    ),
    "cost_map": (
        Peer(
            "scikit-image, masked",
            masked_correlation,
            "correlation instead of Eq. 2, over every offset with overlap, and its peak",
            "skimage",
        ),
        Peer(
            "OpenCV, matchTemplate",
            match_template,
            "correlation instead of Eq. 2; the ground map's holes count as its mean",
        ),
    ),
    "icp": (Peer("Open3D ICP", open3d_icp, "no trimming, and one distance for all steps"),),
}
"""By the name of the row."""
