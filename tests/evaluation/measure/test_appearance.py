"""Image matching on a textured floor, whose images can be computed exactly."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from evaluation.measure.baselines.feature_matching import (
    _distinct,
    locate_camera,
    matches_of,
    sift,
    sift_matcher,
    turned_back,
)
from evaluation.measure.baselines.interface import View
from evaluation.measure.baselines.matched_images import MatchedImages
from evaluation.measure.baselines.views import _likeness
from evaluation.show.figures.fig02_03_matches import matches_figure
from tests.evaluation.measure.closed_worlds import T_GROUND_MAV, bare_floor, error_of, given_of

CAMERA = PinholeCamera(320, 240, 200.0, 200.0, 159.5, 119.5)
TEXELS_PER_M = 150.0
SIDE_M = 6.0


def texture(seed: int) -> NDArray[np.uint8]:
    """Blobs of several sizes over the square around the origin."""
    rng = np.random.default_rng(seed)
    side = int(SIDE_M * TEXELS_PER_M)
    coarse = [rng.uniform(0, 1, (side // n, side // n)) for n in (6, 15, 40)]
    layers = [cv2.resize(blobs, (side, side), interpolation=cv2.INTER_CUBIC) for blobs in coarse]
    return np.clip(255 * sum(layers) / len(layers), 0, 255).astype(np.uint8)


def view_of_floor(T_ground_camera: SE3, picture: NDArray[np.uint8], T_map_ground: SE3) -> View:
    """What a camera sees of the plane z = 0 with this texture, and its depth."""
    rotation, origin = T_ground_camera.rotation, T_ground_camera.translation
    rays = CAMERA.rays() @ rotation.T
    with np.errstate(divide="ignore"):
        depth = np.where(rays[..., 2] < -1e-6, -origin[2] / rays[..., 2], np.nan)
    xy = (origin + rays * depth[..., None])[..., :2]
    texels = ((xy + SIDE_M / 2) * TEXELS_PER_M).astype(np.float32)
    grey = cv2.remap(picture, texels[..., 0], texels[..., 1], cv2.INTER_LINEAR)
    return View(1, CAMERA, T_map_ground @ T_ground_camera, grey, depth.astype(np.float32))


def looking_at(origin: tuple[float, float, float], target: tuple[float, float, float]) -> SE3:
    forward = np.subtract(target, origin)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.1, 1.0])
    right /= np.linalg.norm(right)
    return SE3(np.column_stack([right, np.cross(forward, right), forward]), np.array(origin))


def both_views(aerial_seed: int, ground_seed: int) -> tuple[View, View]:
    aerial = view_of_floor(
        looking_at((0.0, 0.0, 2.0), (0.05, 0.0, 0.0)), texture(aerial_seed), T_GROUND_MAV.inverse()
    )
    ground = view_of_floor(
        looking_at((-1.2, -0.4, 1.4), (0.0, 0.0, 0.0)), texture(ground_seed), SE3.identity()
    )
    return replace(aerial, depth=None), ground


def test_sift_locates_the_mav_over_a_textured_plane() -> None:
    aerial, ground = both_views(1, 1)
    given = replace(given_of(bare_floor()), aerial_view=aerial, ground_views=(ground,))
    answer = sift(given)
    assert answer.claimed, answer.refusal
    assert answer.T_ground_mav is not None
    off_m, off_deg = error_of(answer.T_ground_mav, given)
    assert off_m < 0.03
    assert off_deg < 1.0


def test_other_texture_is_abstained_from() -> None:
    aerial, ground = both_views(1, 2)
    given = replace(given_of(bare_floor()), aerial_view=aerial, ground_views=(ground,))
    answer = sift(given)
    assert not answer.claimed
    assert "agree" in answer.refusal


def test_no_view_of_the_place_is_abstained_from() -> None:
    aerial, _ = both_views(1, 1)
    given = replace(given_of(bare_floor()), aerial_view=aerial)
    assert not sift(given).claimed


def test_features_without_depth_are_not_matched() -> None:
    aerial, ground = both_views(1, 1)
    blind = replace(ground, depth=np.full_like(ground.depth, np.nan))
    matches = matches_of(aerial, (ground, blind), sift_matcher())
    assert len(matches[0].aerial_px) > 12
    assert len(matches[1].aerial_px) == 0
    assert locate_camera(aerial, matches[1:]).T_ground_camera is None


def test_a_corner_found_many_times_counts_once() -> None:
    once = np.array([[10.0, 10.0], [50.0, 30.0], [10.0, 10.0]])
    many = np.repeat(once, 20, axis=0) + np.linspace(0, 1, 60)[:, None]
    other = np.repeat([[5.0, 5.0], [70.0, 80.0], [90.0, 5.0]], 20, axis=0)
    assert list(_distinct(many, other)) == [0, 20, 40]


@pytest.mark.parametrize("turn", [0, 1, 2, 3])
def test_pixels_are_turned_back(turn: int) -> None:
    image = np.zeros((5, 7), np.uint8)
    image[1, 5] = 255
    y, x = np.argwhere(np.rot90(image, turn) == 255)[0]
    np.testing.assert_array_equal(turned_back(np.array([[x, y]]), turn, image.shape), [[5, 1]])


def test_a_black_image_has_no_features() -> None:
    aerial, ground = both_views(1, 1)
    black = replace(aerial, grey=np.zeros_like(aerial.grey))
    matches = matches_of(black, (ground,), sift_matcher())
    assert len(matches[0].aerial_px) == 0


def test_views_that_look_the_mavs_way_are_preferred() -> None:
    floor = np.array([[x, y, 0.0] for x in (-0.3, 0.0, 0.3) for y in (-0.3, 0.0, 0.3)])
    mav = np.array([0.0, 0.0, 2.0])
    steep = looking_at((-0.5, 0.0, 2.0), (0, 0, 0))
    shallow = looking_at((-2.0, 0.0, 0.4), (0, 0, 0))
    away = looking_at((-2.0, 0.0, 0.4), (-4, 0, 0))
    likeness = [_likeness(floor, mav, CAMERA, pose) for pose in (steep, shallow, away)]
    assert likeness[0] > likeness[1] > likeness[2] == 0
    assert _likeness(floor[:0], mav, CAMERA, steep) == 0


def test_figure_draws_each_kind_of_match() -> None:
    rng = np.random.default_rng(0)
    picture = rng.integers(0, 255, (60, 80), np.uint8)
    pixels = rng.uniform(0, 59, (9, 2))
    agrees = np.arange(9) < 4
    matched = MatchedImages(picture, picture[:50], pixels, pixels / 2, agrees, 3, False)
    figure = matches_figure(matched)
    (axes,) = figure.axes
    drawn = [len(lines.get_segments()) for lines in axes.collections]  # type: ignore[attr-defined]
    assert drawn == [5, 4]
    assert "9 matches, 4 agree" in axes.get_title(loc="left")


@pytest.mark.parametrize("count", [0, 3])
def test_too_few_matches_give_no_pose(count: int) -> None:
    aerial, ground = both_views(1, 1)
    matches = matches_of(aerial, (ground,), sift_matcher())
    few = [
        replace(m, aerial_px=m.aerial_px[:count], ground_px=m.ground_px[:count],
                points_ground=m.points_ground[:count])
        for m in matches
    ]  # fmt: skip
    located = locate_camera(aerial, few)
    assert located.T_ground_camera is None
    assert not located.inliers.any()
