"""The group laws of rigid motions, and the conventions of their edges."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from airground.core.se3 import SE3, interpolate, nearest_rotation, rotation_angle

coordinate = st.floats(-10, 10)
twists = st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6).map(np.array)
motions = twists.map(SE3.exp)


def same(a: SE3, b: SE3, tolerance: float = 1e-9) -> bool:
    return np.allclose(a.matrix(), b.matrix(), atol=tolerance)


@given(motions, motions, motions)
def test_composition_is_associative(a: SE3, b: SE3, c: SE3) -> None:
    assert same((a @ b) @ c, a @ (b @ c))


@given(motions)
def test_inverse_undoes(a: SE3) -> None:
    assert same(a @ a.inverse(), SE3.identity())
    assert same(a.inverse() @ a, SE3.identity())


@given(motions, motions, st.lists(coordinate, min_size=3, max_size=3).map(np.array))
def test_composition_moves_points_in_turn(a: SE3, b: SE3, point: np.ndarray) -> None:
    assert np.allclose((a @ b) @ point, a @ (b @ point))
    points = np.stack([point, 2 * point])
    assert np.allclose((a @ points)[1], a @ (2 * point))


@given(twists)
def test_log_undoes_exp(twist: np.ndarray) -> None:
    assert np.allclose(SE3.exp(twist).log(), twist, atol=1e-7)


@given(twists)
def test_exp_is_the_matrix_exponential(twist: np.ndarray) -> None:
    x, y, z = twist[3:]
    generator = np.zeros((4, 4))
    generator[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    generator[:3, 3] = twist[:3]
    assert np.allclose(SE3.exp(twist).matrix(), expm(generator), atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 0.1, 2.0, np.pi - 1e-9, np.pi])
def test_the_angle_is_exact_from_nothing_to_half_a_turn(angle: float) -> None:
    for axis in np.random.default_rng(0).normal(size=(20, 3)):
        turn = SE3.from_rotation_vector(angle * axis / np.linalg.norm(axis))
        assert turn.angle() == pytest.approx(angle, rel=1e-9, abs=2e-15)
        assert rotation_angle(turn.rotation.T) == pytest.approx(angle, rel=1e-9, abs=2e-15)


@given(motions)
def test_quaternion_round_trip(a: SE3) -> None:
    assert same(SE3.from_quaternion_xyzw(a.quaternion_xyzw(), a.translation), a)


def test_quaternion_order_is_tum_xyzw() -> None:
    quarter_turn_about_z = SE3.from_quaternion_xyzw([0, 0, np.sqrt(0.5), np.sqrt(0.5)], [0, 0, 0])
    assert np.allclose(quarter_turn_about_z @ np.array([1.0, 0, 0]), [0, 1, 0])


@given(st.floats(-3, 3))
def test_heading_survives_a_small_tilt(heading: float) -> None:
    tilted = SE3.from_rotation_vector([0.02, -0.03, 0]) @ SE3.from_heading(heading)
    assert SE3.from_heading(heading).heading() == pytest.approx(heading)
    assert tilted.heading() == pytest.approx(heading, abs=2e-3)


def test_interpolation_meets_its_ends_and_halves_the_turn() -> None:
    start, end = SE3.identity(), SE3.from_heading(1.0, [2, 0, 0])
    assert same(interpolate(start, end, 0.0), start)
    assert same(interpolate(start, end, 1.0), end)
    middle = interpolate(start, end, 0.5)
    assert middle.heading() == pytest.approx(0.5)
    assert np.allclose(middle.translation, [1, 0, 0])


def test_long_products_stay_orthonormal() -> None:
    step, pose = SE3.exp(np.array([0.1, 0, 0, 0.3, 0.2, -0.1])), SE3.identity()
    for _ in range(10_000):
        pose = pose @ step
    assert np.abs(pose.rotation @ pose.rotation.T - np.eye(3)).max() < 1e-12


def test_refuses_what_is_no_rigid_motion() -> None:
    with pytest.raises(ValueError, match="not a rotation"):
        SE3(np.diag([1.0, 1.0, -1.0]), np.zeros(3))
    with pytest.raises(ValueError, match="not finite"):
        SE3(np.eye(3), np.array([0, np.nan, 0]))
    with pytest.raises(ValueError, match="shape"):
        SE3(np.eye(3), np.zeros(2))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", range(12))
def test_no_number_of_a_pose_may_be_infinite_or_missing(place: int, value: float) -> None:
    numbers = np.concatenate([np.eye(3).ravel(), np.zeros(3)])
    numbers[place] = value
    with pytest.raises(ValueError, match="not finite"):
        SE3(numbers[:9].reshape(3, 3), numbers[9:])


def test_is_read_only() -> None:
    pose = SE3.identity()
    with pytest.raises(ValueError, match="read-only"):
        pose.translation[0] = 1.0


def test_nearest_rotation_repairs_a_reflection() -> None:
    assert np.linalg.det(nearest_rotation(np.diag([1.0, 1.0, -1.0]))) == pytest.approx(1.0)


def test_long_chains_of_products_stay_orthonormal() -> None:
    step = SE3.from_rotation_vector((0.3, -0.2, 0.9), (0.0, 0.1, 0.0))
    chain = SE3(step.rotation + 1e-7, step.translation)
    for _ in range(2000):
        chain = chain @ step
    assert np.abs(chain.rotation @ chain.rotation.T - np.eye(3)).max() < 1e-14
