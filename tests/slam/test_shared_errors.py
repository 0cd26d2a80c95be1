"""The errors that a map's poses share, against draws of them along a path."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.core.messages import CalibrationSigmas
from airground.core.se3 import SE3
from airground.slam import so3
from airground.slam.shared_errors import BENDS_M, HEADING_WALK, SharedErrors

SIGMAS = CalibrationSigmas(mounting_rad=0.002, clock_s=0.003)
PATH = np.array([[0.0, 0.0, 0.0], [1.0, 0.5, 0.2], [2.5, 0.0, 0.4], [2.0, -1.0, 1.5]])
STILL = np.zeros(3)


def along(
    path: NDArray,
    scale_sigmas: list[float],
    tilt_sigmas: list[float],
    velocity: NDArray = STILL,
    headings: NDArray | None = None,
) -> NDArray:
    """The covariance at the end of a path, without the bends; a robot without headings never
    turns."""
    errors = SharedErrors(SIGMAS)
    facing = np.zeros(len(path)) if headings is None else headings
    for place, heading, *sigmas in zip(path, facing, scale_sigmas, tilt_sigmas, strict=True):
        covariance = errors.at(SE3.from_heading(heading, place), velocity, *sigmas)
    covariance[:3, :3] -= BENDS_M**2 * np.eye(3)
    return covariance


def assert_close(covariance: NDArray, errors: list[NDArray]) -> None:
    expected = np.cov(np.array(errors).T)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(covariance / scale, expected / scale, atol=0.04)


def test_with_the_same_scale_and_vertical_all_along_the_whole_way_is_scaled_and_tilted() -> None:
    rng = np.random.default_rng(3)
    scale_sigma, tilt_sigma, lever = 0.004, 0.003, PATH[-1]
    errors = []
    for _ in range(20_000):
        tilt = so3.exp(np.append(rng.normal(0, tilt_sigma, 2), 0.0))
        mounting = so3.exp(rng.normal(0, SIGMAS.mounting_rad, 3))
        moved = tilt @ (lever * (1 + rng.normal(0, scale_sigma)))
        errors.append(np.concatenate([moved - lever, so3.log(tilt @ mounting)]))
    count = len(PATH)
    assert_close(along(PATH, [scale_sigma] * count, [tilt_sigma] * count), errors)


def test_the_place_stays_where_scale_and_vertical_become_better_known() -> None:
    """Each time, what was unknown is observed with so much noise that the better sigma is left."""
    rng = np.random.default_rng(4)
    scale_sigmas, tilt_sigmas = [0.02, 0.012, 0.008, 0.004], [0.01, 0.006, 0.004, 0.003]
    errors = []
    for _ in range(20_000):
        place = np.zeros(3)
        sigmas = np.array([tilt_sigmas[0], tilt_sigmas[0], scale_sigmas[0]])
        off = rng.normal(0, sigmas)
        for k in range(1, len(PATH)):
            better = np.array([tilt_sigmas[k], tilt_sigmas[k], scale_sigmas[k]])
            noise = 1 / np.sqrt(better**-2 - sigmas**-2)
            off = off - (1 - (better / sigmas) ** 2) * (off + rng.normal(0, noise))
            sigmas = better
            step = PATH[k] - PATH[k - 1]
            place += np.cross([off[0], off[1], 0.0], step) + off[2] * step
        turn = np.array([off[0], off[1], 0.0]) + rng.normal(0, SIGMAS.mounting_rad, 3)
        errors.append(np.concatenate([place, turn]))
    assert_close(along(PATH, scale_sigmas, tilt_sigmas), errors)


def test_the_heading_drifts_with_every_turn_and_takes_the_way_along() -> None:
    rng = np.random.default_rng(6)
    headings = np.array([0.0, 2.0, -1.0, 1.5])
    turned = np.abs(np.diff(headings))
    errors = []
    for _ in range(20_000):
        off = np.cumsum(HEADING_WALK * np.sqrt(turned) * rng.normal(size=len(turned)))
        steps = np.diff(PATH, axis=0)
        place = sum(
            np.cross([0.0, 0.0, angle], step) for angle, step in zip(off, steps, strict=True)
        )
        turn = np.array([0.0, 0.0, off[-1]]) + rng.normal(0, SIGMAS.mounting_rad, 3)
        errors.append(np.concatenate([place, turn]))
    covariance = along(PATH, [0.0] * 4, [0.0] * 4, headings=headings)
    np.testing.assert_allclose(covariance[2], [0, 0, 0, 0, 0, 0], atol=1e-15)
    level = [0, 1, 3, 4, 5]
    assert_close(covariance[np.ix_(level, level)], np.array(errors)[:, level])


def test_back_where_it_began_there_is_no_error_of_scale_and_vertical() -> None:
    there_and_back = np.concatenate([PATH, PATH[::-1]])
    count = len(there_and_back)
    covariance = along(there_and_back, [0.01] * count, [0.01] * count)
    np.testing.assert_allclose(covariance[:3, :3], 0.0, atol=1e-15)


def test_a_clock_that_is_off_counts_by_the_speed() -> None:
    covariance = along(PATH[:1], [0.01], [0.01], np.array([2.0, 0.0, 0.0]))
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)[:3]), [0.006, 0.0, 0.0])


def test_it_is_a_covariance_whatever_the_sigmas_do() -> None:
    rng = np.random.default_rng(5)
    path = np.cumsum(rng.normal(0, 0.3, (200, 3)), axis=0)
    errors = SharedErrors(SIGMAS)
    for place in path:
        sigmas, pose = rng.uniform(0, 0.02, 2), SE3.from_heading(rng.uniform(-3, 3), place)
        covariance = errors.at(pose, rng.normal(0, 1, 3), *sigmas)
        np.testing.assert_allclose(covariance, covariance.T, atol=1e-15)
        assert np.linalg.eigvalsh(covariance)[0] > -1e-12
