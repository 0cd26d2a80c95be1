"""The voxel map against a dictionary, and its laws."""

from collections import defaultdict

import numpy as np
import pytest

from airground.core.voxel_map import VoxelMap


def naive(points: np.ndarray, voxel_m: float) -> dict:
    cells = defaultdict(list)
    for point in points:
        cells[tuple(int(np.floor(c / voxel_m)) for c in point)].append(point)
    return {cell: sum(members) / len(members) for cell, members in cells.items()}


def random_points(n: int = 500) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    return rng.normal(0, 0.2, (n, 3)), rng.integers(0, 256, (n, 3), dtype=np.uint8)


def test_means_match_the_slow_twin() -> None:
    points, colours = random_points()
    fast = VoxelMap(0.1)
    for part in np.array_split(np.arange(len(points)), 7):
        fast.add(points[part], colours[part])
    slow = naive(points, 0.1)
    expected = np.array(sorted(map(tuple, slow.values())))
    got = np.array(sorted(map(tuple, fast.cloud().points.astype(float))))
    assert len(fast) == len(slow)
    assert np.allclose(got, expected, atol=1e-6)


def test_order_of_arrival_does_not_matter() -> None:
    points, colours = random_points()
    one, two = VoxelMap(0.1), VoxelMap(0.1)
    one.add(points, colours)
    for part in reversed(np.array_split(np.arange(len(points)), 5)):
        two.add(points[part], colours[part])
    assert np.allclose(one.cloud().points, two.cloud().points, atol=1e-6)


def test_empty_input_and_far_points() -> None:
    voxels = VoxelMap(0.02)
    voxels.add(np.zeros((0, 3)), np.zeros((0, 3), np.uint8))
    assert len(voxels.cloud()) == 0
    with pytest.raises(ValueError, match="from the origin"):
        voxels.add(np.array([[1e6, 0, 0]]), np.zeros((1, 3), np.uint8))
