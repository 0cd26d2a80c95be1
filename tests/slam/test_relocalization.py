"""Recognizing places: over a textured floor with boxes, seen from other headings."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import cv2
import numpy as np
import pytest

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam.corners import detect_corners
from airground.slam.geometry import descriptors
from airground.slam.geometry.relocalization import (
    KeyframeIndex,
    Relocalization,
    describe_corners,
    pose_from_matches,
)
from tests.slam.views import angle_between, down_at, seen_points

CAMERA = PinholeCamera(376, 240, 210.0, 210.0, 187.5, 119.5)
PX_PER_M = 160
SIDE_M = 8.0
HEIGHT = 2.0


def texture(seed: int) -> np.ndarray:
    """(n, n) grey: random blots of many sizes over a square floor centred on the origin."""
    rng = np.random.default_rng(seed)
    n = int(SIDE_M * PX_PER_M)
    image = np.zeros((n, n), np.float32)
    for blot_px in (8, 16, 32, 96):
        blots = rng.random((n // blot_px + 1, n // blot_px + 1)).astype(np.float32)
        image += cv2.resize(blots, (n, n), interpolation=cv2.INTER_CUBIC) > 0.6
    return cv2.GaussianBlur(50 * image + 20, (0, 0), 0.8).astype(np.uint8)


def render(floor: np.ndarray, T_map_camera: SE3, noise: int) -> np.ndarray:
    """The image of a floor at z = 0, with noise of 3 grey levels."""
    back = T_map_camera.inverse()
    # Columns: image of the floor's x, of its y, and of its origin.
    plane = np.column_stack([back.rotation[:, 0], back.rotation[:, 1], back.translation])
    metres = np.array([[1 / PX_PER_M, 0, -SIDE_M / 2], [0, 1 / PX_PER_M, -SIDE_M / 2], [0, 0, 1]])
    size = (CAMERA.width, CAMERA.height)
    image = cv2.warpPerspective(floor, CAMERA.matrix() @ plane @ metres, size).astype(float)
    image += np.random.default_rng(noise).normal(0, 3, image.shape)
    return image.clip(0, 255).astype(np.uint8)


def floor_points(T_map_camera: SE3, pixels: np.ndarray) -> np.ndarray:
    """(n, 3) where the rays of pixels meet the floor."""
    rays = np.column_stack([pixels, np.ones(len(pixels))]) @ np.linalg.inv(CAMERA.matrix()).T
    rays = rays @ T_map_camera.rotation.T
    return T_map_camera.translation - rays * (T_map_camera.translation[2] / rays[:, 2:])


Lookup = Callable[[np.ndarray], np.ndarray]


@pytest.fixture(scope="module")
def mapped() -> tuple[np.ndarray, KeyframeIndex, Lookup]:
    """A floor, an index of 9 keyframes over it, and the map points' positions."""
    floor, index = texture(0), KeyframeIndex()
    positions = np.zeros((0, 3))
    places = [(x, y) for x in (-1.2, 0.0, 1.2) for y in (-1.2, 0.0, 1.2)]
    for number, (x, y) in enumerate(places):
        T_map_camera = down_at([x, y, HEIGHT])
        image = render(floor, T_map_camera, number)
        pixels = detect_corners(image, np.empty((0, 2), np.float32), 250, 14)
        ids = len(positions) + np.arange(len(pixels))
        positions = np.concatenate([positions, floor_points(T_map_camera, pixels)])
        index.add(10 * number, image, ids, pixels)
    return floor, index, lambda ids: positions[ids]


def find(mapped: tuple[np.ndarray, KeyframeIndex, Lookup], pose: SE3) -> Relocalization | None:
    floor, index, lookup = mapped
    return index.find(render(floor, pose, 99), CAMERA, lookup)


@pytest.mark.parametrize("heading_deg", [0, 37, 90, 180, 265])
def test_finds_a_place_again_from_any_heading(mapped: tuple, heading_deg: float) -> None:
    pose = down_at([0.15, -0.1, HEIGHT + 0.1], [0, 0, np.deg2rad(heading_deg)])
    found = find(mapped, pose)
    assert found is not None
    assert np.linalg.norm(found.fit.T_map_camera.translation - pose.translation) < 0.03
    assert angle_between(found.fit.T_map_camera.rotation, pose.rotation) < np.deg2rad(1.0)
    assert found.fit.inliers.sum() >= 20
    seen = CAMERA.project(pose.inverse() @ mapped[2](found.matches.point_ids[found.fit.inliers]))
    off = np.linalg.norm(seen - found.matches.pixels[found.fit.inliers], axis=1)
    assert np.median(off) < 1.5


def test_finds_a_place_through_tilt_and_light(mapped: tuple) -> None:
    floor, index, lookup = mapped
    pose = down_at([-1.1, 1.0, HEIGHT], [0.15, -0.1, 0.4])
    dark = (0.5 * render(floor, pose, 98) + 10).astype(np.uint8)
    found = index.find(dark, CAMERA, lookup)
    assert found is not None
    assert np.linalg.norm(found.fit.T_map_camera.translation - pose.translation) < 0.05


def test_same_image_same_answer(mapped: tuple) -> None:
    pose = down_at([1.0, 0.2, HEIGHT], [0, 0, 2.0])
    first, second = find(mapped, pose), find(mapped, pose)
    assert first is not None
    assert second is not None
    assert np.array_equal(first.fit.T_map_camera.matrix(), second.fit.T_map_camera.matrix())


def test_another_floor_and_an_empty_image_are_not_recognized(mapped: tuple) -> None:
    _, index, lookup = mapped
    elsewhere = texture(1)
    for x in (-1.0, 0.0, 1.0):
        image = render(elsewhere, down_at([x, 0.3, HEIGHT]), 5)
        assert index.find(image, CAMERA, lookup) is None
    empty = np.full((CAMERA.height, CAMERA.width), 90, np.uint8)
    assert index.find(empty, CAMERA, lookup) is None
    assert KeyframeIndex().find(image, CAMERA, lookup) is None


def test_points_no_longer_mapped_are_left_out(mapped: tuple) -> None:
    floor, index, lookup = mapped
    image = render(floor, down_at([0.1, 0.1, HEIGHT]), 7)

    def half(ids: np.ndarray) -> np.ndarray:
        return np.where((ids % 2 == 0)[:, None], lookup(ids), np.nan)

    found = index.find(image, CAMERA, half)
    assert found is not None
    assert (found.matches.point_ids % 2 == 0).all()
    assert index.find(image, CAMERA, lambda ids: np.full((len(ids), 3), np.nan)) is None


def test_one_keyframe_verifies_a_loop(mapped: tuple) -> None:
    floor, index, lookup = mapped
    pose = down_at([0.2, 0.1, HEIGHT], [0, 0, 3.0])
    query = describe_corners(render(floor, pose, 8))
    assert index.alike(query)[0] == 40
    assert set(index.alike(query, [0, 80])) == {0, 80}
    right, wrong = index.match(query, 40), index.match(query, 80)
    fit = pose_from_matches(lookup(right.point_ids), right.pixels, CAMERA)
    assert fit is not None
    assert np.linalg.norm(fit.T_map_camera.translation - pose.translation) < 0.03
    assert len(wrong.point_ids) < 0.5 * len(right.point_ids)


def test_inliers_in_one_corner_prove_nothing() -> None:
    rng = np.random.default_rng(9)
    pose = down_at([0, 0, 2])
    points = seen_points(pose, 2000, (1.5, 2.2), rng)
    pixels = CAMERA.project(pose.inverse() @ points)
    corner = (pixels < 70).all(axis=1) & (pixels > 0).all(axis=1)
    inside = (pixels > 0).all(axis=1) & (pixels < (376, 240)).all(axis=1)
    assert corner.sum() >= 20
    assert pose_from_matches(points[inside], pixels[inside], CAMERA) is not None
    assert pose_from_matches(points[corner], pixels[corner], CAMERA) is None


def random_descriptors(n: int, rng: np.random.Generator) -> np.ndarray:
    return rng.integers(0, 2**64, (n, 4), dtype=np.uint64)


@pytest.mark.kernel
@pytest.mark.filterwarnings("ignore:overflow")
def test_matching_agrees_with_counting_bits() -> None:
    """The slow twin: numpy on unpacked bits."""
    rng = np.random.default_rng(10)
    known = random_descriptors(30, rng)
    query = np.concatenate([known[[3, 7, 7, 11]], random_descriptors(8, rng)])
    query[:, 0] ^= np.uint64(0b1011)
    query[2, 1] ^= np.uint64(1)
    bits = [np.unpackbits(d.view(np.uint8), axis=1).astype(int) for d in (query, known)]
    distances = np.abs(bits[0][:, None] - bits[1][None]).sum(axis=2)
    for i in range(len(query)):
        for j in range(len(known)):
            assert descriptors.hamming(query[i], known[j]) == distances[i, j]
    rows, partners = descriptors.match(query, known)
    assert rows.tolist() == [0, 1, 3]
    assert partners.tolist() == [3, 7, 11]
    starts = np.array([0, 5, 10, 10, 30])
    near = distances < descriptors.VOTE_DISTANCE
    expected = [near[:, a:b].any(axis=1).sum() for a, b in itertools.pairwise(starts)]
    assert descriptors.votes(query, known, starts).tolist() == expected


@pytest.mark.parametrize("first", [0, 32, 64, 96, 128, 160, 200])
@pytest.mark.parametrize(("apart", "alike"), [(0, 1), (47, 1), (48, 0), (56, 0)])
def test_a_vote_counts_differences_wherever_they_are(first: int, apart: int, alike: int) -> None:
    rng = np.random.default_rng(11)
    known = random_descriptors(1, rng)
    bits = np.unpackbits(known.view(np.uint8))
    bits[first : first + apart] ^= 1
    query = np.packbits(bits).view(np.uint64).reshape(1, 4)
    assert descriptors.votes(query, known, np.array([0, 1])).tolist() == [alike]
