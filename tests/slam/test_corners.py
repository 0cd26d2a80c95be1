"""Corners are where squares have them, spread out, and away from those already followed."""

from __future__ import annotations

import numpy as np

from airground.slam.corners import BORDER_PX, NOT_PREFERRED, detect_corners
from tests.slam.textures import texture

NOTHING = np.empty((0, 2), np.float32)
SPACING_PX = 20


def chessboard(square_px: int) -> np.ndarray:
    y, x = np.mgrid[:240, :320] // square_px
    return (200 * ((x + y) % 2) + 20).astype(np.uint8)


def test_corners_of_a_chessboard_are_its_crossings() -> None:
    corners = detect_corners(chessboard(40), NOTHING, 100, 40)
    assert len(corners) > 20
    # Squares meet between pixels 39 and 40.
    off = np.abs((corners + 0.5) / 40 - np.rint((corners + 0.5) / 40)) * 40
    assert off.max() < 2.0


def test_a_plain_image_and_one_with_plain_edges_have_none() -> None:
    plain = np.full((240, 320), 90, np.uint8)
    stripes = np.where(np.arange(320) % 40 < 20, 50, 200).astype(np.uint8) * np.ones((240, 1))
    assert len(detect_corners(plain, NOTHING, 100, SPACING_PX)) == 0
    assert len(detect_corners(stripes.astype(np.uint8), NOTHING, 100, SPACING_PX)) == 0


def test_a_cell_gives_one_corner_and_the_border_none() -> None:
    corners = detect_corners(texture(), NOTHING, 1000, SPACING_PX)
    cells = np.unique(corners // SPACING_PX, axis=0)
    assert len(cells) == len(corners) > 100
    assert (corners >= BORDER_PX).all()
    assert (corners < np.array([320, 240]) - BORDER_PX).all()


def test_new_corners_keep_their_distance_from_those_followed() -> None:
    rng = np.random.default_rng(0)
    occupied = rng.uniform((-30, -30), (350, 270), (25, 2)).astype(np.float32)
    corners = detect_corners(texture(), occupied, 1000, SPACING_PX)
    distances = np.linalg.norm(corners[:, None] - occupied[None], axis=2)
    assert len(corners) > 20
    assert distances.min() >= SPACING_PX - 1  # drawn as a circle of whole pixels


def test_with_fewer_wanted_the_strongest_stay() -> None:
    every = detect_corners(texture(), NOTHING, 1000, SPACING_PX)
    np.testing.assert_array_equal(detect_corners(texture(), NOTHING, 30, SPACING_PX), every[:30])
    for wanted in (0, -5):
        assert detect_corners(texture(), NOTHING, wanted, SPACING_PX).shape == (0, 2)


def test_a_corner_with_depth_wins_against_a_stronger_one_without() -> None:
    image = np.full((240, 320), 100, np.uint8)
    image[60:75, 60:75] = 200  # without depth, sharp
    image[64:75, 84:95] = 140  # with depth, faint but well above 0.03 of the other
    assert NOT_PREFERRED < (40 / 100) ** 2
    preferred = np.zeros(image.shape, bool)
    preferred[:, 80:] = True
    first = detect_corners(image, NOTHING, 1, 60)
    first_with_depth = detect_corners(image, NOTHING, 1, 60, preferred)
    assert first[0, 0] < 80 <= first_with_depth[0, 0]
