"""Blocks that a view touches: a slow twin, Open3D, and a wall."""

from __future__ import annotations

import numpy as np
import open3d as o3d
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.ground_map.blocked_field import BLOCK, empty_grid
from airground.ground_map.touched_blocks import STEPS, STRIDE, touched_blocks, unique_blocks

CAMERA = PinholeCamera(66, 49, 52.0, 51.0, 31.5, 23.5)
"""Its sides are no multiples of the stride."""
VOXEL_M, TRUNCATION_M, MAX_DEPTH_M = 0.05, 0.2, 4.0
REACH = (BLOCK * VOXEL_M, TRUNCATION_M, MAX_DEPTH_M)


def seen(seed: int) -> tuple[NDArray[np.float32], SE3]:
    """A depth image with holes and pixels too far, and where it was taken."""
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.05, 4.5, (CAMERA.height, CAMERA.width)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.2] = 0.0
    return depth, SE3.from_rotation_vector(rng.normal(0, 1, 3), rng.normal(0, 2, 3))


def slowly(depth: NDArray[np.float32], T_map_camera: SE3) -> set[tuple[int, ...]]:
    """Every ray by itself, in double precision."""
    blocks = set()
    rays = CAMERA.rays()
    for v in range(0, CAMERA.height // STRIDE * STRIDE, STRIDE):
        for u in range(0, CAMERA.width // STRIDE * STRIDE, STRIDE):
            if not 0 < depth[v, u] < MAX_DEPTH_M:
                continue
            near = max(depth[v, u] - TRUNCATION_M, 0.0)
            far = min(depth[v, u] + TRUNCATION_M, MAX_DEPTH_M)
            for at in np.linspace(near, far, STEPS + 1):
                point = T_map_camera @ (at * rays[v, u])
                blocks.add(tuple(int(i) for i in np.floor(point / REACH[0])))
    return blocks


@pytest.mark.kernel
@settings(deadline=None, max_examples=10)  # the first example compiles
@given(st.integers(0, 2**32 - 1))
def test_every_fourth_pixel_touches_the_blocks_around_what_it_measured(seed: int) -> None:
    depth, pose = seen(seed)
    found, wanted = touched_blocks(depth, CAMERA, pose, *REACH), slowly(depth, pose)
    # A point on the border of two blocks may round to either.
    assert len({tuple(block) for block in found.tolist()} ^ wanted) <= 0.002 * len(wanted)
    assert (np.unique(found, axis=0) == found).all()


@pytest.mark.parametrize("seed", range(5))
def test_they_are_those_that_open3d_finds(seed: int) -> None:
    depth, pose = seen(seed)
    tensor = o3d.core.Tensor.from_numpy
    blocks = empty_grid(VOXEL_M, 10).compute_unique_block_coordinates(
        o3d.t.geometry.Image(tensor(depth)),
        tensor(CAMERA.matrix()),
        tensor(pose.inverse().matrix()),
        depth_scale=1.0,
        depth_max=MAX_DEPTH_M,
        trunc_voxel_multiplier=TRUNCATION_M / VOXEL_M,
    )
    theirs = {tuple(block) for block in blocks.numpy().tolist()}
    ours = {tuple(block) for block in touched_blocks(depth, CAMERA, pose, *REACH).tolist()}
    assert len(ours ^ theirs) <= 0.002 * len(theirs)


@pytest.mark.kernel
def test_a_wall_touches_what_lies_about_it() -> None:
    wall = np.full((CAMERA.height, CAMERA.width), 2.1, np.float32)
    blocks = touched_blocks(wall, CAMERA, SE3.identity(), *REACH)
    assert set(blocks[:, 2].tolist()) == {4, 5}  # of 0.4 m, from 1.9 to 2.3 m
    assert blocks[:, 0].min() == np.floor(-2.3 * CAMERA.cx / CAMERA.fx / 0.4)


@pytest.mark.kernel
def test_nothing_measured_touches_nothing() -> None:
    nothing = np.zeros((CAMERA.height, CAMERA.width), np.float32)
    for depth in (nothing, nothing + np.float32(9.0), nothing + np.float32(np.nan)):
        assert touched_blocks(depth, CAMERA, SE3.identity(), *REACH).shape == (0, 3)


@pytest.mark.kernel
@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_unique_blocks_are_those_of_numpy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    blocks = rng.integers(-6, 7, (rng.integers(1, 300), 3)).astype(np.int32)
    assert unique_blocks(blocks).tolist() == np.unique(blocks, axis=0).tolist()
