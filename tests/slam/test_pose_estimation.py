"""The robust pose of one image."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import chi2

from airground.core.se3 import SE3
from airground.slam.geometry.pose_estimation import PoseFit, estimate_pose
from tests.slam.views import CAMERA, angle_between, down_at, observe, seen_points

TRUTH = down_at([0.4, -0.3, 2.2], [0.05, -0.08, 0.7])


def off_by(pose: SE3, turn: list, shift: list) -> SE3:
    """Turned in the map's axes, and shifted."""
    rotation = SE3.from_rotation_vector(turn).rotation @ pose.rotation
    return SE3(rotation, pose.translation + np.asarray(shift))


def error(fit: PoseFit, truth: SE3) -> np.ndarray:
    """Position [m], then rotation vector of estimate times inverse truth [rad]."""
    turn = SE3(fit.T_map_camera.rotation @ truth.rotation.T, np.zeros(3)).rotation_vector()
    return np.concatenate([fit.T_map_camera.translation - truth.translation, turn])


def test_exact_data_give_the_exact_pose() -> None:
    rng = np.random.default_rng(0)
    points = seen_points(TRUTH, 50, (1.2, 2.6), rng)
    start = off_by(TRUTH, [0.05, -0.04, 0.06], [0.1, -0.1, 0.15])
    fit = estimate_pose(points, observe(TRUTH, points), np.ones(50), CAMERA, start)
    assert np.abs(error(fit, TRUTH)).max() < 1e-9
    assert fit.inliers.all()
    assert fit.rms_px < 1e-6


@pytest.mark.parametrize("outliers", [0.0, 0.2, 0.35])
def test_outliers_are_named_and_do_not_move_the_pose(outliers: float) -> None:
    rng = np.random.default_rng(1)
    points = seen_points(TRUTH, 200, (1.2, 2.6), rng)
    pixels = observe(TRUTH, points) + 0.5 * rng.standard_normal((200, 2))
    wrong = np.arange(200) < 200 * outliers
    pixels[wrong] += rng.uniform(8, 40, (wrong.sum(), 2)) * rng.choice([-1, 1], (wrong.sum(), 2))
    start = off_by(TRUTH, [0.01, -0.01, 0.01], [0.03, 0.02, -0.02])
    fit = estimate_pose(points, pixels, np.full(200, 0.5), CAMERA, start)
    assert not fit.inliers[wrong].any()
    assert fit.inliers[~wrong].mean() > 0.9
    assert np.linalg.norm(error(fit, TRUTH)[:3]) < 0.006
    assert 0.5 < fit.rms_px < 0.8


@pytest.mark.kernel
def test_agrees_with_a_general_solver() -> None:
    """The slow twin: scipy on the same residuals, without outliers or loss."""
    rng = np.random.default_rng(2)
    points = seen_points(TRUTH, 12, (1.2, 2.6), rng)
    pixels = observe(TRUTH, points) + 0.3 * rng.standard_normal((12, 2))
    inverse = 1 / (TRUTH.inverse() @ points)[:, 2] + 0.003 * rng.standard_normal(12)
    inverse[::3] = np.nan
    start = off_by(TRUTH, [0.003, -0.004, 0.002], [0.01, 0.005, -0.01])

    def residuals(x: np.ndarray) -> np.ndarray:
        pose = off_by(start, x[3:], x[:3])
        depth = (1 / (pose.inverse() @ points)[:, 2] - inverse)[np.isfinite(inverse)]
        parts = ((observe(pose, points) - pixels).ravel() / 0.5, depth / 0.005)
        return np.concatenate([*parts, x[:3] / 0.02, x[3:] / 0.004])

    slow = least_squares(residuals, np.zeros(6), xtol=1e-14, ftol=1e-14)
    fit = estimate_pose(
        points,
        pixels,
        np.full(12, 0.5),
        CAMERA,
        start,
        inverse_depths=inverse,
        inverse_depth_sigmas=np.full(12, 0.005),
        rotation_sigma=0.004,
        position_sigma=0.02,
        huber=50.0,
    )
    assert fit.inliers.all()
    np.testing.assert_allclose(error(fit, off_by(start, slow.x[3:], slow.x[:3])), 0, atol=2e-7)
    expected = np.linalg.inv(slow.jac.T @ slow.jac)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(fit.covariance / scale, expected / scale, atol=0.02)


def test_covariance_says_how_large_errors_are() -> None:
    rng = np.random.default_rng(3)
    squares = []
    for _ in range(300):
        points = seen_points(TRUTH, 40, (1.2, 2.6), rng)
        pixels = observe(TRUTH, points) + 0.5 * rng.standard_normal((40, 2))
        # Rejecting the noise's tails would shrink the errors' scatter: a wide sigma keeps them.
        fit = estimate_pose(points, pixels, np.full(40, 1.0), CAMERA, TRUTH, huber=50.0)
        off = error(fit, TRUTH)
        squares.append(off @ np.linalg.solve(fit.covariance / 4, off))
    low, high = chi2.ppf([1e-4, 1 - 1e-4], 6 * 300) / 300
    assert low < np.mean(squares) < high


def test_the_prior_holds_what_the_image_does_not_tell() -> None:
    rng = np.random.default_rng(4)
    points = seen_points(TRUTH, 2, (1.2, 2.6), rng)
    start = off_by(TRUTH, [0.0, 0.0, 0.0], [0.02, 0.0, 0.0])
    pixels = observe(TRUTH, points)
    free = estimate_pose(points, pixels, np.ones(2), CAMERA, start)
    assert np.isnan(free.covariance).all()
    held = estimate_pose(points, pixels, np.ones(2), CAMERA, start, rotation_sigma=1e-4)
    assert np.linalg.norm(error(held, TRUTH)) < 1e-3
    assert np.isfinite(held.covariance).all()


def test_without_points_the_start_comes_back() -> None:
    none = np.zeros((0, 3)), np.zeros((0, 2)), np.zeros(0)
    fit = estimate_pose(*none, CAMERA, TRUTH, rotation_sigma=0.01, position_sigma=0.1)
    assert np.abs(error(fit, TRUTH)).max() < 1e-12
    np.testing.assert_allclose(np.diag(fit.covariance), [1e-2] * 3 + [1e-4] * 3)
    assert np.isnan(fit.rms_px)


def test_depth_across_an_edge_is_left_out_without_its_pixel() -> None:
    rng = np.random.default_rng(5)
    points = seen_points(TRUTH, 60, (1.2, 2.6), rng)
    inverse = 1 / (TRUTH.inverse() @ points)[:, 2]
    inverse[:15] -= 0.1
    fit = estimate_pose(
        points,
        observe(TRUTH, points),
        np.full(60, 0.5),
        CAMERA,
        off_by(TRUTH, [0.01, 0.01, 0.0], [0.02, 0.0, 0.02]),
        inverse_depths=inverse,
        inverse_depth_sigmas=np.full(60, 0.003),
    )
    assert fit.inliers.all()
    assert np.abs(error(fit, TRUTH)).max() < 1e-6


def test_depth_tells_the_distance_to_a_far_wall() -> None:
    """Few pixels in a corner know the bearing only; with depth the position is better known."""
    rng = np.random.default_rng(6)
    points = seen_points(TRUTH, 30, (3.9, 4.0), rng)
    inverse = 1 / (TRUTH.inverse() @ points)[:, 2]
    pixels = observe(TRUTH, points)
    plain = estimate_pose(points, pixels, np.full(30, 0.5), CAMERA, TRUTH)
    deep = estimate_pose(
        points,
        pixels,
        np.full(30, 0.5),
        CAMERA,
        TRUTH,
        inverse_depths=inverse,
        inverse_depth_sigmas=np.full(30, 0.0005),
    )
    assert np.trace(deep.covariance[:3, :3]) < np.trace(plain.covariance[:3, :3])


def test_many_steps_leave_a_rotation() -> None:
    rng = np.random.default_rng(7)
    points = seen_points(TRUTH, 100, (1.2, 2.6), rng)
    pose = off_by(TRUTH, [0.02, 0.0, 0.0], [0.0, 0.0, 0.0])
    for _ in range(100):
        pixels = observe(TRUTH, points) + 0.5 * rng.standard_normal((100, 2))
        pose = estimate_pose(points, pixels, np.full(100, 0.5), CAMERA, pose).T_map_camera
    assert np.abs(pose.rotation @ pose.rotation.T - np.eye(3)).max() < 1e-14
    assert angle_between(pose.rotation, TRUTH.rotation) < 0.003
