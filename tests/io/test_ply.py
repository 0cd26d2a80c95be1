"""Clouds survive the disk, and other tools read them."""

from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

from airground.core.cloud import PointCloud
from airground.errors import InputError
from airground.io.ply import read_ply, write_ply


def cloud(count: int = 50, normals: bool = True) -> PointCloud:
    rng = np.random.default_rng(0)
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return PointCloud(
        rng.normal(size=(count, 3)).astype(np.float32),
        rng.integers(0, 256, (count, 3), np.uint8),
        direction.astype(np.float32) if normals else None,
    )


@pytest.mark.parametrize("count", [0, 50])
@pytest.mark.parametrize("normals", [False, True])
@pytest.mark.parametrize("with_sources", [False, True])
def test_a_cloud_comes_back(tmp_path: Path, count: int, normals: bool, with_sources: bool) -> None:
    original = cloud(count, normals)
    sources = (np.arange(count) % 2).astype(np.uint8) if with_sources else None
    write_ply(tmp_path / "a.ply", original, sources)
    read, read_sources = read_ply(tmp_path / "a.ply")
    np.testing.assert_array_equal(read.points, original.points)
    np.testing.assert_array_equal(read.colours, original.colours)
    assert (read.normals is None) == (not normals)
    if normals:
        np.testing.assert_array_equal(read.normals, original.normals)
    if sources is None:
        assert read_sources is None
    else:
        np.testing.assert_array_equal(read_sources, sources)


def test_open3d_reads_the_same_cloud(tmp_path: Path) -> None:
    original = cloud()
    write_ply(tmp_path / "a.ply", original, np.ones(50, np.uint8))
    read = o3d.io.read_point_cloud(str(tmp_path / "a.ply"))
    np.testing.assert_array_equal(np.asarray(read.points), original.points)
    np.testing.assert_allclose(np.asarray(read.colors) * 255, original.colours, atol=1e-6)
    np.testing.assert_allclose(np.asarray(read.normals), original.normals, atol=1e-6)


@pytest.mark.parametrize(
    ("damage", "pattern"),
    [
        (lambda data: data[:-1], "is truncated"),
        (lambda data: data[1:], "no PLY"),
        (lambda data: data.replace(b"binary_little_endian", b"ascii"), "is truncated"),
        (lambda data: data.replace(b"property float x\n", b""), "has more after"),
        (lambda data: data.replace(b"property float x", b"property float a"), "lacks x"),
        (lambda data: data.replace(b"uchar red", b"char red"), "'red' of another type"),
    ],
)
def test_a_damaged_file_is_reported(tmp_path: Path, damage, pattern: str) -> None:
    file = tmp_path / "a.ply"
    write_ply(file, cloud())
    file.write_bytes(damage(file.read_bytes()))
    with pytest.raises(InputError, match=pattern):
        read_ply(file)


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.ply"):
        read_ply(tmp_path / "none.ply")
