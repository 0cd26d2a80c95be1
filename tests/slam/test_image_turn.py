"""A camera's turn from its images alone: sizes and signs.

It is good to half a pixel of the shrunk image, which is all that optical flow needs to start.
"""

from __future__ import annotations

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.slam.image_turn import SMALL_WIDTH, ImageTurn
from tests.slam.textures import CAMERA, texture, turned

IMAGE = texture()
HALF_PX = 0.5 * round(CAMERA.width / SMALL_WIDTH) / CAMERA.fy
"""In radians."""


def follow(R_a_b: np.ndarray) -> np.ndarray | None:
    turn = ImageTurn(CAMERA)
    assert turn.follow(IMAGE) is None
    return turn.follow(turned(IMAGE, R_a_b))


@pytest.mark.parametrize(
    ("about_x", "about_y"), [(0.03, 0.0), (-0.05, 0.0), (0.0, 0.04), (0.0, -0.06), (0.02, -0.03)]
)
def test_it_measures_turns_about_the_axes_of_the_image(about_x: float, about_y: float) -> None:
    R_a_b = SE3.from_rotation_vector((about_x, about_y, 0.0)).rotation
    measured = follow(R_a_b)
    np.testing.assert_allclose(measured, [about_x, about_y], atol=1.1 * HALF_PX)


def test_a_roll_is_no_turn_about_the_other_axes() -> None:
    measured = follow(SE3.from_rotation_vector((0.0, 0.0, 0.03)).rotation)
    np.testing.assert_allclose(measured, [0.0, 0.0], atol=HALF_PX)


def test_turns_count_from_the_image_before() -> None:
    turn = ImageTurn(CAMERA)
    for about_y in (0.0, 0.02, 0.05):
        measured = turn.follow(turned(IMAGE, SE3.from_rotation_vector((0, about_y, 0)).rotation))
    np.testing.assert_allclose(measured, [0.0, 0.03], atol=HALF_PX)


def test_where_images_have_nothing_in_common_it_says_so() -> None:
    for other in [*(texture(seed=seed) for seed in range(1, 21)), np.zeros_like(IMAGE)]:
        turn = ImageTurn(CAMERA)
        turn.follow(IMAGE)
        assert turn.follow(other) is None


def test_a_turn_by_a_third_of_the_image_is_still_seen() -> None:
    measured = follow(SE3.from_rotation_vector((0.0, 0.4, 0.0)).rotation)
    np.testing.assert_allclose(measured, [0.0, 0.4], atol=0.03)
