"""Shared errors in a pose's covariance, against draws of them."""

from __future__ import annotations

import numpy as np

from airground.slam import so3
from airground.slam.frame_pose import MOUNTING_SIGMA, with_shared_errors


def test_the_covariance_is_that_of_drawn_scales_tilts_and_mountings() -> None:
    rng = np.random.default_rng(3)
    lever, scale_sigma, tilt_sigma = np.array([2.0, -1.0, 1.5]), 0.004, 0.003
    errors = []
    for _ in range(20_000):
        tilt = so3.exp(np.append(rng.normal(0, tilt_sigma, 2), 0.0))
        mounting = so3.exp(rng.normal(0, MOUNTING_SIGMA, 3))
        moved = tilt @ (lever * (1 + rng.normal(0, scale_sigma)))
        errors.append(np.concatenate([moved - lever, so3.log(tilt @ mounting)]))
    expected = np.cov(np.array(errors).T)
    covariance = with_shared_errors(np.zeros((6, 6)), lever, scale_sigma, tilt_sigma)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(covariance / scale, expected / scale, atol=0.04)


def test_within_the_map_it_only_grows() -> None:
    inner = np.diag([1e-6, 2e-6, 3e-6, 1e-8, 1e-8, 1e-8])
    total = with_shared_errors(inner, np.array([1.0, 2.0, 3.0]), 0.01, 0.01)
    assert np.linalg.eigvalsh(total - inner)[0] > -1e-12
