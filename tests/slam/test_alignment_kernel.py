"""The compiled normal equations against residuals by the book and their differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airground.slam import so3
from airground.slam.inertial.alignment import VisualNoise, _chain
from airground.slam.inertial.alignment_kernel import BAND, SHARED, STATE, Chain, normal_equations
from airground.slam.inertial.alignment_start import tangent_basis
from airground.slam.inertial.preintegration import GRAVITY_MAP
from tests.slam.inertial_keyframes import T_RIG_CAMERA, keyframes_of
from tests.slam.inertial_motion import lively

COUNT = 5


def log(rotation: np.ndarray) -> np.ndarray:
    return Rotation.from_matrix(rotation).as_rotvec()


def residuals(chain: Chain, motions: list, rotations, vectors, unit, gravity) -> np.ndarray:
    """All white residuals, keyframe after keyframe."""
    parts = []
    for k in range(COUNT):
        R, (p, v, gyro, force) = rotations[k], vectors[k]
        parts.append(log(chain.rotations[k].T @ R) / chain.sigmas[0])
        parts.append((unit * (p + R @ chain.lever) - chain.centres[k]) / chain.sigmas[1])
        if k == 0 or motions[k - 1] is None:
            parts += [v / chain.sigmas[2], gyro / chain.sigmas[3], force / chain.sigmas[4]]
        if k + 1 == COUNT or motions[k] is None:
            continue
        R2, (p2, v2, gyro2, force2) = rotations[k + 1], vectors[k + 1]
        t = motions[k].duration_s
        turn, sped, moved = motions[k].corrected(gyro, force)
        error = [
            log(turn.T @ R.T @ R2),
            R.T @ (v2 - v - t * gravity) - sped,
            R.T @ (p2 - p - t * v - 0.5 * t**2 * gravity) - moved,
        ]
        parts.append(chain.whitening[k] @ np.concatenate(error))
        parts.append((gyro2 - gyro) / chain.walks[k, 0])
        parts.append((force2 - force) / chain.walks[k, 1])
    return np.concatenate(parts)


@pytest.mark.kernel
@pytest.mark.parametrize("hole", [None, 2])
def test_normal_equations_are_those_of_the_residuals(hole):
    rng = np.random.default_rng(3)
    k = keyframes_of(lively(rng), 1.0, rng)
    motions = [None if i == hole else m for i, m in enumerate(k.motions)]
    chain = _chain(k.rotations, k.centres, T_RIG_CAMERA, motions, VisualNoise(0.01, 0.01), 0.1)
    rotations = k.rotations @ Rotation.from_rotvec(rng.normal(0, 0.1, (COUNT, 3))).as_matrix()
    vectors = rng.normal(0, 0.1, (COUNT, 4, 3))
    vectors[:, 0] += 2.5 * k.centres
    gravity = Rotation.from_rotvec(rng.normal(size=3)).apply(GRAVITY_MAP.copy())
    basis = tangent_basis(gravity)

    def at(step: np.ndarray) -> np.ndarray:
        own = step[:-SHARED].reshape(COUNT, 5, 3)
        turned = rotations @ Rotation.from_rotvec(own[:, 0]).as_matrix()
        unit = 0.4 * np.exp(-step[-SHARED])
        fallen = so3.exp(basis @ step[-2:]) @ gravity
        return residuals(chain, motions, turned, vectors + own[:, 1:], unit, fallen)

    h, size = 1e-5, STATE * COUNT + SHARED
    J = np.stack([(at(h * e) - at(-h * e)) / (2 * h) for e in np.eye(size)], axis=1)
    r = at(np.zeros(size))
    tilts = -so3.hat(gravity) @ basis
    band, border, top, cost = normal_equations(chain, rotations, vectors, 0.4, gravity, tilts)
    n = STATE * COUNT
    H = np.zeros((n, n))
    for offset in range(BAND):
        for j in range(n - offset):
            H[j + offset, j] = H[j, j + offset] = band[offset, j]
    whole = np.block([[H, border[:, :SHARED]], [border[:, :SHARED].T, top[:, :SHARED]]])
    scale = np.sqrt(np.diag(J.T @ J))
    np.testing.assert_allclose(
        whole / np.outer(scale, scale), J.T @ J / np.outer(scale, scale), atol=1e-6
    )
    gradient = np.concatenate([border[:, SHARED], top[:, SHARED]])
    np.testing.assert_allclose(gradient / scale, J.T @ r / scale, atol=1e-6 * np.linalg.norm(r))
    assert cost == pytest.approx(r @ r)
