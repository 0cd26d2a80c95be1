"""Points of the ground map's surface against Open3D's, planes, and blocks in any order."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import open3d as o3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from airground.core.camera import PinholeCamera
from airground.ground_map.blocked_field import BLOCK, COLOUR_SCALE, BlockedField, empty_grid
from airground.ground_map.surface_points import neighbours, surface_points

CAMERA = PinholeCamera(40, 30, 34.0, 34.0, 19.5, 14.5)
VOXEL_M = 0.02


def fused_steps(seed: int) -> o3d.t.geometry.VoxelBlockGrid:
    """Noisy images of a step, from poses close by."""
    grid = empty_grid(VOXEL_M, 10)
    rng = np.random.default_rng(seed)
    intrinsics = o3d.core.Tensor.from_numpy(CAMERA.matrix())
    for _ in range(3):
        metres = np.where(np.arange(40) < 17, 0.6, 0.8) + rng.normal(0, 0.003, (30, 40))
        metres[:, rng.integers(0, 40)] = 0.0
        depth = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(metres.astype(np.float32)))
        levels = rng.integers(0, 256, (30, 40, 3)).astype(np.float32)
        colour = o3d.t.geometry.Image(o3d.core.Tensor.from_numpy(levels))
        pose = np.eye(4)
        pose[:3, 3] = rng.normal(0, 0.05, 3)
        extrinsics = o3d.core.Tensor.from_numpy(pose)
        blocks = grid.compute_unique_block_coordinates(depth, intrinsics, extrinsics, 1.0, 4.0, 4.0)
        grid.integrate(blocks, depth, colour, intrinsics, extrinsics, 1.0, 4.0, 4.0)
    return grid


def field_of(grid: o3d.t.geometry.VoxelBlockGrid) -> BlockedField:
    return BlockedField.of(grid, VOXEL_M)


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(3))
def test_points_are_those_that_open3d_finds(seed: int) -> None:
    grid = fused_steps(seed)
    ours, theirs = surface_points(field_of(grid), 1.5), grid.extract_point_cloud(1.5)
    points = theirs.point.positions.numpy()
    assert len(ours) == len(points) > 300
    distance, index = cKDTree(points).query(ours.points)
    assert distance.max() == 0
    assert len(set(index)) == len(points)
    colours = theirs.point.colors.numpy()[index]
    assert np.abs(ours.colours - colours).max() < 0.51
    # Where no block lies beside a voxel Open3D takes the slope of the edge before (0.19).
    off = np.abs(ours.normals - theirs.point.normals.numpy()[index]).max(axis=1)
    assert np.quantile(off, 0.9) < 1e-5


@pytest.mark.kernel
def test_the_order_of_the_blocks_changes_nothing() -> None:
    field = field_of(fused_steps(0))
    shuffled = np.random.default_rng(1).permutation(len(field.rows))
    other = replace(field, places=field.places[shuffled], rows=field.rows[shuffled])
    one, two = surface_points(field, 1.5), surface_points(other, 1.5)
    assert one.points.tobytes() == two.points.tobytes()
    assert one.colours.tobytes() == two.colours.tobytes()
    assert one.normals.tobytes() == two.normals.tobytes()


def plane_field(normal: np.ndarray, offset: float, weight: float = 3.0) -> BlockedField:
    """The distance to a plane [voxels] in 2 x 2 x 2 blocks about the origin."""
    places = np.array(list(itertools.product((-1, 0), repeat=3)), np.int32)
    z, y, x = np.meshgrid(*[np.arange(BLOCK)] * 3, indexing="ij")
    voxels = np.stack([x, y, z], axis=-1) + BLOCK * places[:, None, None, None]
    tsdf = (voxels @ normal - offset).astype(np.float32)
    # Colours grow along x, so that a point's gives its place.
    colour = np.repeat(100.0 + voxels[..., :1], 3, axis=-1).astype(np.float32) * COLOUR_SCALE
    rows = np.arange(8, dtype=np.int32)
    return BlockedField(places, rows, tsdf, np.full_like(tsdf, weight), colour, VOXEL_M)


@pytest.mark.kernel
@given(
    direction=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda d: np.linalg.norm(d) > 0.1),
    offset=st.floats(-3, 3),
)
@settings(deadline=None, max_examples=20)
def test_a_plane_comes_back(direction: tuple[float, float, float], offset: float) -> None:
    normal = np.array(direction) / np.linalg.norm(direction)
    cloud = surface_points(plane_field(normal, offset), 0.5)
    assert len(cloud) >= 100
    assert np.abs(cloud.points / VOXEL_M @ normal - offset).max() < 1e-4
    # Across the blocks' outer faces no slope is known; inside it is the plane's.
    inner = (np.abs(cloud.points / VOXEL_M + 0.5) < BLOCK - 2).all(axis=1)
    assert np.abs(cloud.normals[inner] - normal).max() < 1e-4
    expected = 100 + cloud.points[:, 0] / VOXEL_M
    assert np.abs(cloud.colours[:, 0] - expected).max() < 0.51


@pytest.mark.kernel
def test_what_too_few_keyframes_saw_is_left_out() -> None:
    up = np.array([0.0, 0.0, 1.0])
    field = plane_field(up, 0.4)
    assert len(surface_points(field, 3.0)) == 0
    assert len(surface_points(field, 2.9)) == 16 * 16
    # One voxel below the plane is unknown: the edge to it goes.
    lower = field.rows[np.flatnonzero((field.places == (0, 0, 0)).all(axis=1))[0]]
    field.weight[lower, 0, 2, 3] = 2.0
    cloud = surface_points(field, 2.9)
    assert len(cloud) == 16 * 16 - 1
    gone = np.array([3, 2, 0.4]) * VOXEL_M
    assert np.linalg.norm(cloud.points - gone, axis=1).min() > 0.9 * VOXEL_M


def test_an_empty_field_has_no_points() -> None:
    field = plane_field(np.array([0.0, 0.0, 1.0]), 0.4)
    nothing = replace(field, places=field.places[:0], rows=field.rows[:0])
    assert len(surface_points(nothing, 0.5)) == 0


@pytest.mark.kernel
@given(
    blocks=st.sets(st.tuples(*[st.integers(-3, 3)] * 3), max_size=40),
    far=st.sampled_from([0, 1 << 19, -(1 << 19)]),
)
@settings(deadline=None)
def test_neighbours_are_those_of_a_dictionary(blocks: set[tuple[int, int, int]], far: int) -> None:
    # Ascending by z, then y, then x: the order of the words.
    places = sorted(((x + far, y, z) for x, y, z in blocks), key=lambda place: place[::-1])
    words = np.array([(z << 42) + (y << 21) + x for x, y, z in places], np.int64)
    table = neighbours(words)
    index = {place: i for i, place in enumerate(places)}
    steps = [(x, y, z) for z in (-1, 0, 1) for y in (-1, 0, 1) for x in (-1, 0, 1)]
    for block, (x, y, z) in enumerate(places):
        wanted = [index.get((x + dx, y + dy, z + dz), -1) for dx, dy, dz in steps]
        assert table[block].tolist() == wanted
