"""Views taken into the distance field against a slow twin, Open3D, and planes."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from airground.config import GroundMapping
from airground.core.camera import PinholeCamera
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.ground_map import GroundMap
from airground.ground_map.blocked_field import BLOCK, COLOUR_SCALE, BlockedField, empty_grid
from airground.ground_map.integration import add_view, integrate

CAMERA = PinholeCamera(64, 48, 52.0, 52.0, 31.5, 23.5)
VOXEL_M, TRUNCATION_M = 0.05, 0.2
SHAPE = (2, BLOCK, BLOCK, BLOCK)


def slowly(
    places: NDArray, depth: NDArray, colour: NDArray, T_camera_map: SE3, field: list[NDArray]
) -> None:
    """Every voxel by itself, in double precision."""
    tsdf, weight, colours = field
    for row, (bx, by, bz) in enumerate(places):
        for k, j, i in np.ndindex(BLOCK, BLOCK, BLOCK):
            voxel = BLOCK * np.array([bx, by, bz]) + (i, j, k)
            point = T_camera_map @ (voxel * VOXEL_M)
            if point[2] <= 0:
                continue
            u, v = np.floor(CAMERA.project(point[None])[0] + 0.5).astype(int)
            if not (0 <= u < CAMERA.width and 0 <= v < CAMERA.height):
                continue
            distance = depth[v, u] - point[2]
            if depth[v, u] <= 0 or distance < -TRUNCATION_M:
                continue
            n = weight[row, k, j, i]
            before = tsdf[row, k, j, i]
            tsdf[row, k, j, i] = (n * before + min(distance / TRUNCATION_M, 1.0)) / (n + 1)
            mean = colours[row, k, j, i]
            colours[row, k, j, i] = (n * mean + COLOUR_SCALE * colour[v, u]) / (n + 1)
            weight[row, k, j, i] = n + 1


@pytest.mark.kernel
@settings(deadline=None, max_examples=10)  # the first example compiles
@given(st.integers(0, 2**32 - 1))
def test_every_voxel_reads_the_pixel_it_falls_on(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = np.array([[-1, 0, 2], [0, -1, 3]], np.int32)
    rows = rng.permutation(2).astype(np.int32)
    fields = [[np.zeros(SHAPE, t), np.zeros(SHAPE, t), np.zeros((*SHAPE, 3), t)] for t in "fd"]
    for _ in range(2):
        depth = rng.uniform(0.7, 1.9, (48, 64)).astype(np.float32)
        depth[rng.random(depth.shape) < 0.1] = 0.0
        colour = rng.integers(0, 256, (48, 64, 3), np.uint8)
        T_camera_map = SE3.from_rotation_vector(rng.normal(0, 0.1, 3), rng.normal(0, 0.1, 3))
        pinhole = np.array([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy], np.float32)
        motion = T_camera_map.matrix()[:3].astype(np.float32)
        bounds = np.float32(VOXEL_M), np.float32(TRUNCATION_M)
        add_view(places, rows, depth, colour, pinhole, motion, *bounds, tuple(fields[0]))
        slowly(places[np.argsort(rows)], depth, colour, T_camera_map, fields[1])
    # A voxel between two pixels may round to either.
    alike = fields[0][1] == fields[1][1]
    assert alike.mean() > 0.999
    assert fields[1][1].max() == 2
    for ours, theirs, close in zip(fields[0], fields[1], (1e-4, 0, 1e-1), strict=True):
        same = np.isclose(ours, theirs, atol=close, rtol=1e-5)
        assert same.mean() > 0.999


def test_open3d_given_half_a_pixel_more_finds_the_same_field() -> None:
    ours, theirs = (empty_grid(VOXEL_M, 10) for _ in range(2))
    rng = np.random.default_rng(0)
    intrinsics, shifted = CAMERA.matrix(), CAMERA.matrix()
    shifted[:2, 2] += 0.5
    for _ in range(3):
        depth = (1.5 + rng.normal(0, 0.02, (48, 64))).astype(np.float32)
        colour = rng.integers(0, 256, (48, 64, 3), np.uint8)
        pose = SE3.from_rotation_vector(rng.normal(0, 0.1, 3), rng.normal(0, 0.1, 3))
        seen = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(depth))
        painted = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(colour.astype(np.float32)))
        motion = o3d.core.Tensor.from_numpy(pose.inverse().matrix())
        reach = (1.0, 4.0, TRUNCATION_M / VOXEL_M)
        tensor = o3d.core.Tensor.from_numpy
        blocks = ours.compute_unique_block_coordinates(seen, tensor(intrinsics), motion, *reach)
        integrate(ours, blocks.numpy(), depth, colour, CAMERA, pose, VOXEL_M, TRUNCATION_M)
        theirs.integrate(blocks, seen, painted, tensor(shifted), motion, *reach)
    fields = [BlockedField.of(one, VOXEL_M).copy() for one in (ours, theirs)]
    order = [np.lexsort(field.places.T) for field in fields]
    for name, close in (("places", 0), ("tsdf", 1e-5), ("weight", 0), ("colour", 1e-1)):
        one, two = (getattr(field, name)[at] for field, at in zip(fields, order, strict=True))
        # Open3D leaves the outer half of the border's pixels out.
        assert np.isclose(one, two, atol=close, rtol=1e-5).mean() > 0.95, name
    assert fields[0].weight.sum() >= fields[1].weight.sum() > 1000


@pytest.mark.parametrize("normal", [(0.0, 1.0, 0.0), (0.5, 0.0, 1.0), (-0.4, 0.3, 1.0)])
def test_a_plane_lies_where_it_is_however_it_is_seen(normal: tuple[float, float, float]) -> None:
    """A floor below a level camera is seen at a shallow angle: half a pixel were 7 mm there."""
    camera = PinholeCamera(160, 120, 130.0, 130.0, 79.5, 59.5)
    direction = np.array(normal) / np.linalg.norm(normal)
    offset_m = 0.5 if direction[2] == 0 else 1.5
    slope = camera.rays() @ direction
    with np.errstate(divide="ignore"):
        depth = (offset_m / slope).astype(np.float32)
    depth[(depth < 0) | (depth > 3.5)] = np.nan
    config = GroundMapping(min_keyframes=1, voxel_m=0.01, truncation_m=0.04)
    ground_map = GroundMap(camera, config)
    ground_map.add(GroundImage(0, np.zeros((120, 160, 3), np.uint8), depth), SE3.identity())
    off = ground_map.cloud().points @ direction - offset_m
    assert len(off) > 10_000
    assert abs(np.median(off)) < 1e-3
