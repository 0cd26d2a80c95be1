"""Trajectory errors of paths whose error is known."""

import numpy as np
import pytest

from airground.core.se3 import SE3
from evaluation.table.trajectory_error import trajectory_error

STAMPS = [int(i * 1e8) for i in range(200)]


def true_pose(stamp_ns: int) -> SE3:
    angle = stamp_ns * 2 * np.pi / 20e9
    return SE3.from_heading(angle, [2 * np.cos(angle), 2 * np.sin(angle), 0.3 * np.sin(3 * angle)])


def test_another_map_frame_is_no_error() -> None:
    T_map_world = SE3.exp(np.array([1.0, -2.0, 0.5, 0.1, 0.2, 2.0]))
    error = trajectory_error([(t, T_map_world @ true_pose(t)) for t in STAMPS], true_pose)
    assert error.se3_rmse_m < 1e-9
    assert error.scale_error == pytest.approx(0, abs=1e-9)
    assert error.path_m == pytest.approx(4 * np.pi, rel=0.1)


def test_scale_shows_only_without_scale_correction() -> None:
    small = [(t, SE3(true_pose(t).rotation, 0.9 * true_pose(t).translation)) for t in STAMPS]
    error = trajectory_error(small, true_pose)
    assert error.scale_error == pytest.approx(1 / 0.9 - 1)
    assert error.sim3_rmse_m < 1e-9
    radius = np.sqrt(np.mean([np.sum(true_pose(t).translation ** 2) for t in STAMPS]))
    assert error.se3_rmse_m == pytest.approx(0.1 * radius, rel=0.02)


def test_noise_comes_back_as_its_size() -> None:
    rng = np.random.default_rng(0)
    noisy = [
        (t, SE3(true_pose(t).rotation, true_pose(t).translation + rng.normal(0, 0.01, 3)))
        for t in STAMPS
    ]
    assert trajectory_error(noisy, true_pose).se3_rmse_m == pytest.approx(0.01 * 3**0.5, rel=0.1)


def test_the_relative_error_is_the_drift_per_metre() -> None:
    """A path along x whose estimate is 2 % too long, seen from another map frame."""
    straight = {
        t: SE3(np.eye(3), [0.5 * t * 1e-9, 0.0, 0.02 * (i % 2)]) for i, t in enumerate(STAMPS)
    }
    T_map_world = SE3.exp(np.array([1.0, -2.0, 0.5, 0.1, 0.2, 2.0]))
    exact = [(t, T_map_world @ pose) for t, pose in straight.items()]
    assert trajectory_error(exact, straight.__getitem__).rpe_1m_rmse_m < 1e-9
    stretch = np.array([1.02, 1.0, 1.0])
    long = [
        (t, T_map_world @ SE3(p.rotation, stretch * p.translation)) for t, p in straight.items()
    ]
    error = trajectory_error(long, straight.__getitem__)
    assert error.rpe_1m_rmse_m == pytest.approx(0.02, rel=0.15)


def test_a_path_shorter_than_a_metre_has_no_relative_error() -> None:
    short = {t: SE3(np.eye(3), [0.002 * i, 0.001 * (i % 3), 0.0]) for i, t in enumerate(STAMPS)}
    error = trajectory_error(list(short.items()), short.__getitem__)
    assert np.isnan(error.rpe_1m_rmse_m)
    assert error.se3_rmse_m < 1e-9
