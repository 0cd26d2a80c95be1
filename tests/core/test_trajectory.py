"""Interpolation in time, and what a trajectory refuses."""

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory


def straight() -> Trajectory:
    return Trajectory.from_poses(
        [0, 10, 30],
        [SE3.identity(), SE3.from_heading(0.2, [1, 0, 0]), SE3.from_heading(0.2, [3, 0, 0])],
    )


def test_interpolates_and_hits_the_samples() -> None:
    path = straight()
    assert np.allclose(path.at(10).translation, [1, 0, 0])
    assert np.allclose(path.at(20).translation, [2, 0, 0])
    assert path.at(5).heading() == pytest.approx(0.1)
    assert path.path_m() == pytest.approx(3.0)


def test_does_not_extrapolate() -> None:
    with pytest.raises(ValueError, match="outside the trajectory"):
        straight().at(31)


@pytest.mark.parametrize(
    ("stamps", "translation", "message"),
    [
        ([0, 0], 0.0, "strictly increase"),
        ([1, 0], 0.0, "strictly increase"),
        ([0, 1], np.nan, "finite"),
    ],
)
def test_refuses_broken_input(stamps: list[int], translation: float, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Trajectory(np.array(stamps), np.tile(np.eye(3), (2, 1, 1)), np.full((2, 3), translation))
