"""The pose of one image, whatever share of its points went astray."""

from __future__ import annotations

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.slam.frame_pose import BLUR, frame_pose
from airground.slam.geometry.pose_estimation import PoseFit
from airground.slam.motion_model import POSITION_SIGMA_M
from tests.slam.views import CAMERA, down_at, observe, seen_points

TRUE = down_at([0.4, -0.3, 2.2], (0.04, -0.03, 0.5))
PREDICTED = TRUE @ SE3.from_rotation_vector((0.001, -0.001, 0.001), (0.03, -0.02, 0.02))
COUNT, SIGMA_PX = 150, 0.7
WITH_GYRO = pytest.mark.parametrize("gyro", [True, False], ids=["gyro", "no gyro"])


def fit_of(
    gyro: bool,
    outliers: float = 0.0,
    noise_px: float = SIGMA_PX,
    count: int = COUNT,
    predicted: SE3 = PREDICTED,
    depth: bool = False,
    inertial: bool = False,
    seed: int = 0,
) -> tuple[PoseFit | None, np.ndarray]:
    """The fit, and which points are outliers."""
    rng = np.random.default_rng(seed)
    points = seen_points(TRUE, count, (1.5, 2.5), rng)
    pixels = observe(TRUE, points) + rng.normal(0, noise_px, (count, 2))
    wrong = np.arange(count) < outliers * count
    pixels[wrong] += rng.uniform(8, 60, (wrong.sum(), 2)) * rng.choice([-1, 1], (wrong.sum(), 2))
    inverse = 1.0 / (TRUE.inverse() @ points)[:, 2] + rng.normal(0, 0.003, count)
    inverse[::3] = np.nan
    fit = frame_pose(
        points,
        pixels,
        CAMERA,
        predicted,
        sigma_px=SIGMA_PX,
        rotation_sigma=2e-3 if gyro else None,
        position_sigma=POSITION_SIGMA_M if inertial else None,
        min_points=15,
        rng=rng,
        inverse_depths=inverse if depth else None,
        inverse_depth_sigma=0.003,
    )
    return fit, wrong


def errors(fit: PoseFit | None) -> tuple[float, float]:
    """Metres and radians."""
    assert fit is not None
    off = TRUE.inverse() @ fit.T_map_camera
    return float(np.linalg.norm(off.translation)), off.angle()


@WITH_GYRO
@pytest.mark.parametrize("outliers", [0.0, 0.2, 0.45])
@pytest.mark.parametrize("depth", [False, True])
def test_outliers_are_distinguished_from_points_that_fit(
    gyro: bool, outliers: float, depth: bool
) -> None:
    fit, wrong = fit_of(gyro, outliers, depth=depth)
    moved, turned = errors(fit)
    assert (moved < 0.006, turned < 0.003) == (True, True)
    assert fit is not None
    assert not fit.inliers[wrong].any()
    assert fit.inliers[~wrong].mean() > 0.85  # a gate at 95 %


@WITH_GYRO
def test_a_blurred_image_still_gives_a_pose_that_says_how_much_worse_it_is(gyro: bool) -> None:
    sharp, _ = fit_of(gyro)
    blurred, _ = fit_of(gyro, noise_px=BLUR * SIGMA_PX)
    assert errors(blurred)[0] < 0.02
    assert sharp is not None
    assert blurred is not None
    assert blurred.inliers.mean() > 0.8
    sigmas = [np.sqrt(np.trace(fit.covariance[:3, :3])) for fit in (sharp, blurred)]
    assert 1.5 < sigmas[1] / sigmas[0] < 4.0


@WITH_GYRO
def test_what_agrees_by_chance_is_no_pose(gyro: bool) -> None:
    assert fit_of(gyro, outliers=0.75)[0] is None
    assert fit_of(gyro, outliers=1.0)[0] is None
    assert fit_of(gyro, count=14)[0] is None
    assert fit_of(gyro, count=30, outliers=0.55)[0] is None  # 13 are left


def test_errors_stay_within_what_the_fit_states() -> None:
    squares = []
    for seed in range(40):
        fit, _ = fit_of(True, 0.2, seed=seed, predicted=TRUE)
        assert fit is not None
        error = fit.T_map_camera.translation - TRUE.translation
        squares.append(error @ np.linalg.solve(fit.covariance[:3, :3], error))
    assert 1.5 < np.mean(squares) < 6.0  # chi-square of three degrees has mean 3


def test_the_inertial_prediction_counts_where_the_image_says_little() -> None:
    near = TRUE @ SE3(np.eye(3), np.array([0.004, 0.0, 0.004]))
    free, held = (fit_of(True, count=15, predicted=near, inertial=i)[0] for i in (False, True))
    assert free is not None
    assert held is not None
    assert (np.diag(held.covariance)[:3] < np.diag(free.covariance)[:3]).all()
    assert (np.diag(held.covariance)[:3] < POSITION_SIGMA_M**2).all()


def test_the_same_samples_give_the_same_bytes() -> None:
    first, second = (fit_of(False, 0.4)[0] for _ in range(2))
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first.T_map_camera.matrix(), second.T_map_camera.matrix())
