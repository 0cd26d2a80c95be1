"""Compiled rotations against SciPy, and the Jacobians against what they claim."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from airground.slam import so3

pytestmark = pytest.mark.kernel

AXES = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 1e-3)
ANGLES = st.one_of(
    st.sampled_from([0.0, 1e-12, 1e-6, 0.99e-4, 1.01e-4, np.pi - 1e-9]), st.floats(0, 3.14)
)


def vector(axis: tuple[float, ...], angle: float) -> np.ndarray:
    return angle * np.array(axis) / np.linalg.norm(axis)


@settings(deadline=None)
@given(AXES, ANGLES)
def test_exp_and_log_agree_with_scipy(axis, angle):
    v = vector(axis, angle)
    expected = Rotation.from_rotvec(v).as_matrix()
    np.testing.assert_allclose(so3.exp(v), expected, atol=1e-14)
    np.testing.assert_allclose(so3.log(expected), v, atol=1e-12, rtol=1e-7)


@settings(deadline=None)
@given(AXES, ANGLES.filter(lambda a: a < 3.1), AXES)
def test_right_jacobians_are_what_a_small_turn_does(axis, angle, direction):
    v, step = vector(axis, angle), 1e-6 * np.array(direction)
    moved = so3.log(so3.exp(v).T @ so3.exp(v + step))
    np.testing.assert_allclose(so3.right_jacobian(v) @ step, moved, atol=2e-12)
    product = so3.right_jacobian(v) @ so3.right_jacobian_inverse(v)
    np.testing.assert_allclose(product, np.eye(3), atol=1e-9)


@settings(deadline=None)
@given(AXES, AXES)
def test_hat_is_the_cross_product(a, b):
    np.testing.assert_allclose(so3.hat(np.array(a)) @ np.array(b), np.cross(a, b), atol=1e-15)
