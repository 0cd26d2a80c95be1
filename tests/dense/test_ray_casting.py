"""The zero level set: against loops, and true depth there and back again."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.core.surface import DepthMap
from airground.dense.distance_field import FieldHistogram
from airground.dense.fusion import Fusion
from airground.dense.ray_casting import cast_surface, surface_cloud
from airground.dense.volume import Volume, resized
from tests.dense import synthetic

CAMERA = synthetic.SMALL_CAMERA.halved()
FREE = np.uint32(1 << 28)
NEAR = np.uint32(1 << 16)


def slow_crossing(
    column: NDArray, supported: NDArray[np.bool_], planes: NDArray, reach: int
) -> float:
    """Depth of the first supported crossing; a fitted line's zero where phi only falls."""
    for k in range(len(column) - 1):
        if column[k] > 0 and column[k + 1] <= 0 and (supported[k] or supported[k + 1]):
            position = column[k] / (column[k] - column[k + 1])
            window = np.arange(1 - reach, reach + 1)
            if k + 1 - reach >= 0 and k + reach < len(column):
                values = column[k + window]
                if (np.diff(values) <= 0).all():
                    slope, level = np.polyfit(window, values, 1)
                    if abs(-level / slope - position) <= 1.5:
                        position = -level / slope
            return planes[k] + position * (planes[1] - planes[0])
    return np.nan


@pytest.mark.kernel
def test_scan_equals_a_loop_over_columns() -> None:
    rng = np.random.default_rng(0)
    volume = Volume(resized(CAMERA, 12, 9), SE3.identity(), 1.0, 2.0, 14)
    noise = rng.normal(0, 1, volume.shape)
    falling = np.sort(noise, axis=1)[:, ::-1]
    phi = np.where(rng.random((9, 1, 12)) < 0.5, noise, falling).astype(np.float32)
    counts = np.where(rng.random(volume.shape) < 0.5, FREE, NEAR).astype(np.uint32)
    depth, _ = cast_surface(volume, phi, counts, 1, 0.4)
    for y, x in np.ndindex(9, 12):
        expected = slow_crossing(phi[y, :, x], counts[y, :, x] == NEAR, volume.depths(), 2)
        np.testing.assert_allclose(depth[y, x], expected, atol=1e-5)


def test_quantized_ramp_is_found_to_a_fraction_of_a_voxel() -> None:
    camera = resized(CAMERA, 40, 4)
    volume = Volume(camera, SE3.identity(), 1.0, 2.0, 101)
    truth = np.broadcast_to(np.linspace(1.4, 1.6, 40), (4, 40))
    ramp = np.clip((truth[:, None, :] - volume.depths()[None, :, None]) / 0.07, -1, 0.999)
    phi = ((np.floor((ramp + 1) * 4) + 0.5) / 4 - 1).astype(np.float32)
    depth, normals = cast_surface(volume, phi, np.full(volume.shape, NEAR), 1, 0.07)
    assert np.abs(depth - truth).max() < 0.35 * 0.01
    assert (normals[..., 2] < 0).all()


def test_true_depth_comes_back_within_a_voxel() -> None:
    world = synthetic.heap_world(2, boxes=12)
    poses = synthetic.flight(41)[::8]
    maps = []
    for pose in poses:
        depth = world.depth(CAMERA, pose)
        image = np.zeros(depth.shape, np.uint8)
        maps.append(DepthMap(0, CAMERA, pose, depth, image, 7))
    reference = maps[len(maps) // 2]
    volume = Volume.around(maps, reference, (120, 80, 150), 0.07)
    histogram = FieldHistogram(volume, 0.07)
    for one in maps:
        histogram.add(one)
    phi = Fusion(0.26, 8).fuse(histogram.counts)
    depth, normals = cast_surface(volume, phi, histogram.counts, 2, 0.07)
    error = np.abs(depth - reference.depth)
    voxel = (volume.far_m - volume.near_m) / 149
    assert np.isfinite(depth).mean() > 0.97
    assert np.nanmedian(error) < 0.25 * voxel
    assert np.nanpercentile(error, 85) < voxel
    cloud = surface_cloud(volume, depth, normals, reference)
    np.testing.assert_allclose(np.linalg.norm(cloud.normals, axis=1), 1, atol=1e-4)
    floor = np.abs(cloud.points[:, 2]) < 0.003
    assert floor.any()
    assert np.median(cloud.normals[floor] @ np.array([0, 0, 1])) > 0.98


@pytest.mark.kernel
def test_seen_points_equal_arrays_of_them() -> None:
    rng = np.random.default_rng(4)
    T_mav_camera = SE3.exp(rng.normal(0, 0.5, 6))
    volume = Volume(resized(CAMERA, 15, 11), T_mav_camera, 1.0, 2.0, 5)
    depth = rng.uniform(1, 2, (11, 15)).astype(np.float32)
    depth[rng.random((11, 15)) < 0.3] = np.nan
    normals = rng.normal(0, 1, (11, 15, 3)).astype(np.float32)
    shape = CAMERA.height, CAMERA.width
    image = rng.integers(0, 256, shape, np.uint8)
    reference = DepthMap(0, CAMERA, T_mav_camera, np.ones(shape, np.float32), image, 1)
    cloud = surface_cloud(volume, depth, normals, reference)
    seen = np.isfinite(depth)
    points = T_mav_camera @ (volume.camera.rays()[seen] * depth[seen][:, None])
    np.testing.assert_allclose(cloud.points, points, atol=1e-6)
    np.testing.assert_allclose(cloud.normals, normals[seen] @ T_mav_camera.rotation.T, atol=1e-6)
    rows, columns = np.nonzero(seen)
    grey = image[rows * shape[0] // 11, columns * shape[1] // 15]
    assert np.array_equal(cloud.colours, np.repeat(grey[:, None], 3, axis=1))
    nothing = surface_cloud(volume, np.full_like(depth, np.nan), normals, reference)
    assert len(nothing) == 0


def test_no_point_where_too_few_maps_agree() -> None:
    volume = Volume(resized(CAMERA, 8, 6), SE3.identity(), 1.0, 2.0, 11)
    phi = np.ones(volume.shape, np.float32)
    phi[:, 5:] = -1
    depth, normals = cast_surface(volume, phi, np.full(volume.shape, FREE), 1, 0.1)
    assert np.isnan(depth).all()
    assert np.isnan(normals).all()
