import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from airground.errors import InputError
from sim.robots.paths import (
    SmoothCurve,
    heading_path,
    minimum_jerk,
    planar_path,
    random_curve,
    scale_jet,
    sinusoids,
)

COORDINATES = st.floats(-5, 5)


def assert_derivatives_fit(jet_at, times, tolerance=1e-5):
    """Each derivative equals the central difference of the one before."""
    h = 1e-4
    before, here, after = (jet_at(times + shift) for shift in (-h, 0.0, h))
    for order in (1, 2):
        np.testing.assert_allclose(
            here[order], (after[order - 1] - before[order - 1]) / (2 * h), atol=tolerance
        )


@settings(max_examples=40, deadline=None)
@given(
    arrays(float, st.tuples(st.integers(2, 6), st.just(2)), elements=COORDINATES),
    st.floats(0.1, 3),
    st.floats(0.1, 1),
)
def test_planar_path_keeps_its_speed_and_stays_in_the_hull(waypoints, speed, rounding):
    path = planar_path(waypoints, speed, start_s=1.0, rounding_s=rounding)
    times = np.linspace(0, path.end_s + 2, 400)
    position, velocity, _ = path.jet(times)
    assert np.linalg.norm(velocity, axis=1).max() <= speed * (1 + 1e-9)
    assert (position >= waypoints.min(axis=0) - 1e-9).all()
    assert (position <= waypoints.max(axis=0) + 1e-9).all()


@settings(max_examples=40, deadline=None)
@given(
    arrays(float, st.tuples(st.integers(2, 6), st.just(3)), elements=COORDINATES),
    st.floats(0.1, 2),
    st.floats(0.1, 2),
)
def test_heading_path_keeps_both_limits(waypoints, speed, turn):
    path = heading_path(waypoints, speed, turn, start_s=0.0)
    velocity = path.jet(np.linspace(0, path.end_s, 400))[1]
    assert np.linalg.norm(velocity[:, :2], axis=1).max() <= speed * (1 + 1e-9)
    assert np.abs(velocity[:, 2]).max() <= turn * (1 + 1e-9)


def test_path_rests_at_both_ends():
    waypoints = [[0, 0], [2, 0], [2, 1]]
    path = planar_path(waypoints, 0.5, start_s=2.0)
    jet = path.jet([0.0, 1.99, path.end_s, path.end_s + 100])
    np.testing.assert_allclose(jet[0], [[0, 0], [0, 0], [2, 1], [2, 1]], atol=1e-12)
    np.testing.assert_allclose(jet[1:], 0, atol=1e-12)


def test_path_reaches_its_speed_and_passes_near_its_corner():
    path = planar_path([[0, 0], [3, 0], [3, 3]], 0.5, start_s=0.0)
    position, velocity, _ = path.jet(np.arange(0, path.end_s, 0.01))
    assert np.linalg.norm(velocity, axis=1).max() == pytest.approx(0.5, rel=1e-6)
    assert np.linalg.norm(position - [3, 0], axis=1).min() < 0.15


def test_path_is_as_long_as_its_polyline_says():
    path = planar_path([[0, 0], [2, 0]], 0.5, start_s=1.0, rounding_s=0.5)
    # 4 s at full speed, and three steps of the spline to start and to stop.
    assert path.end_s - path.start_s == pytest.approx(4.0 + 2 * 3 * 0.5)


def test_heading_turns_the_shorter_way():
    waypoints = np.deg2rad([[0, 0, 170], [0, 0, -170]])
    path = heading_path(waypoints, 0.5, 0.3, start_s=0.0)
    assert np.rad2deg(path.jet([path.end_s])[0][0, 2]) == pytest.approx(190)


def test_repeated_waypoints_stand_still():
    path = planar_path([[1, 2], [1, 2]], 0.5, start_s=0.0)
    np.testing.assert_allclose(path.jet([0.0, 1.0, 9.0])[0], [[1, 2]] * 3)


def test_derivatives_are_exact():
    rng = np.random.default_rng(0)
    times = np.linspace(0.5, 6.0, 97)
    path = heading_path(rng.uniform(-1, 1, (4, 3)), 0.5, 0.5, start_s=0.3)
    noise = random_curve(rng, 0.0, 7.0, 0.4, [1.0, 0.1])
    rise = lambda t: minimum_jerk(t, 1.0, 3.0)  # noqa: E731
    sway = lambda t: sinusoids(t, [0.1, 0.2], [0.3, 0.4], [0.0, 1.0])  # noqa: E731
    assert_derivatives_fit(path.jet, times)
    assert_derivatives_fit(noise.jet, times)
    assert_derivatives_fit(rise, times)
    assert_derivatives_fit(lambda t: scale_jet(sway(t), rise(t)), times)


def test_minimum_jerk_goes_from_zero_to_one():
    jet = minimum_jerk([0.0, 1.0, 2.5, 4.0, 9.0], 1.0, 3.0)[..., 0]
    np.testing.assert_allclose(jet[0], [0, 0, 0.5, 1, 1])
    np.testing.assert_allclose(jet[1, [0, 1, 3, 4]], 0)


def test_random_curve_has_the_asked_deviation_and_bound():
    deviations = [0.5, 2.0]
    curve = random_curve(np.random.default_rng(1), 0.0, 1000.0, 0.5, deviations)
    value = curve.jet(np.arange(0, 1000, 0.1))[0]
    np.testing.assert_allclose(value.std(axis=0), deviations, rtol=0.08)
    assert (np.abs(value) <= 4 * np.array(deviations)).all()


@pytest.mark.parametrize(
    ("waypoints", "speed", "message"),
    [
        ([[0, 0]], 0.5, "at least 2 are needed, got 1"),
        ([], 0.5, "waypoints must be"),
        ([[0, 0], [1, 2, 3]], 0.5, "only numbers"),
        ([[0, 0], ["a", 1]], 0.5, "only numbers"),
        ([[0, 0, 0], [1, 2, 3]], 0.5, "shape"),
        ([[0, 0], [1, np.nan]], 0.5, "number 2 is"),
        ([[0, 0], [1, 1]], 0.0, "speed_mps must be positive"),
        ([[0, 0], [1, 1]], -1.0, "speed_mps must be positive"),
        ([[0, 0], [1, 1]], np.nan, "speed_mps must be positive"),
    ],
)
def test_bad_paths_are_refused(waypoints, speed, message):
    with pytest.raises(InputError, match=message):
        planar_path(waypoints, speed, start_s=0.0)


def test_bad_turn_rate_is_refused():
    with pytest.raises(InputError, match="turn rate must be positive"):
        heading_path([[0, 0, 0], [1, 0, 0]], 0.5, 0.0, start_s=0.0)


def test_too_few_controls_are_refused():
    with pytest.raises(ValueError, match="controls"):
        SmoothCurve(np.zeros((4, 2)), 0.0, 0.1)
