"""Votes of depth maps at voxels, against plain loops."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.core.surface import DepthMap
from airground.dense.distance_field import MAX_BINS, MAX_DEPTH_MAPS, FieldHistogram
from airground.dense.volume import Volume, resized

CAMERA = PinholeCamera(24, 16, 14.0, 14.0, 11.4, 7.6)


def depth_map(depth: NDArray, pose: SE3) -> DepthMap:
    return DepthMap(0, CAMERA, pose, depth, np.zeros((16, 24), np.uint8), 7)


def unpack(words: NDArray[np.uint32]) -> NDArray[np.int64]:
    return np.stack(
        [(words >> np.uint32(4 * j)) & np.uint32(15) for j in range(MAX_BINS)], -1
    ).astype(np.int64)


def slow_votes(volume: Volume, seen: DepthMap, truncation: float, bins: int) -> NDArray[np.int64]:
    """One voxel at a time: project, look up, compare."""
    counts = np.zeros((*volume.shape, MAX_BINS), np.int64)
    T_map_volume = seen.T_mav_camera.inverse() @ volume.T_mav_camera
    rays = volume.camera.rays()
    for y, k, x in np.ndindex(*volume.shape):
        point = T_map_volume @ (rays[y, x] * volume.depths()[k])
        if point[2] <= 0:
            continue
        u, v = seen.camera.project(point[None])[0]
        column, row = int(np.floor(u + 0.5)), int(np.floor(v + 0.5))
        if not (0 <= column < seen.camera.width and 0 <= row < seen.camera.height):
            continue
        field = (seen.depth[row, column] - point[2]) / truncation
        if field >= -1:
            counts[y, k, x, min(int((min(field, 1.0) + 1) * bins / 2), bins - 1)] += 1
    return counts


@pytest.mark.kernel
@pytest.mark.parametrize("bins", [8, 5])
def test_votes_equal_the_loops(bins: int) -> None:
    rng = np.random.default_rng(0)
    depth = rng.uniform(1.0, 2.0, (16, 24)).astype(np.float32)
    depth[rng.random((16, 24)) < 0.2] = np.nan
    seen = depth_map(depth, SE3.from_rotation_vector((0.05, -0.03, 0.1), (0.1, -0.07, 0.05)))
    volume = Volume(resized(CAMERA, 30, 18), SE3.identity(), 0.8, 2.2, 11)
    histogram = FieldHistogram(volume, 0.2, bins)
    histogram.add(seen)
    same = (unpack(histogram.counts) == slow_votes(volume, seen, 0.2, bins)).all(axis=-1)
    # single precision may decide otherwise right between two pixels or bins
    assert same.mean() > 0.998


def test_hidden_voxels_and_holes_get_no_vote() -> None:
    depth = np.full((16, 24), 1.5, np.float32)
    depth[:, :12] = np.nan
    volume = Volume(CAMERA, SE3.identity(), 1.0, 2.0, 21)
    histogram = FieldHistogram(volume, 0.1)
    histogram.add(depth_map(depth, SE3.identity()))
    votes = unpack(histogram.counts).sum(-1)
    assert (votes[:, :, :12] == 0).all()
    behind = volume.depths() > 1.5 + 0.1 + 1e-4
    assert (votes[:, behind, 12:] == 0).all()
    assert (votes[:, volume.depths() < 1.59, 12:] == 1).all()
    assert (unpack(histogram.counts)[:, volume.depths() < 1.39, 12:, MAX_BINS - 1] == 1).all()


def test_a_full_histogram_takes_no_more() -> None:
    volume = Volume(CAMERA, SE3.identity(), 1.0, 2.0, 5)
    histogram = FieldHistogram(volume, 0.1)
    one = depth_map(np.full((16, 24), 1.5, np.float32), SE3.identity())
    for _ in range(MAX_DEPTH_MAPS):
        histogram.add(one)
    assert unpack(histogram.counts).max() == MAX_DEPTH_MAPS
    with pytest.raises(ValueError, match="at most 15"):
        histogram.add(one)
