"""Bundle adjustment: back to the truth, honest about what it knows, calm where it knows nothing."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from airground.slam import so3
from airground.slam.bundle_adjustment import (
    Adjustment,
    InertialFactor,
    Observations,
    Role,
    Settings,
    adjust,
)
from tests.slam import bundle_problems as made

WHOLE = Settings(iterations=25, relative_decrease=1e-12)
WITHOUT_PRIORS = replace(WHOLE, gyro_bias_prior_sigma=None, accelerometer_bias_prior_sigma=None)


def run(problem, roles, states, points, settings=WHOLE) -> Adjustment:
    return adjust(
        states,
        roles,
        points,
        problem.observations,
        problem.inertial,
        made.CAMERA,
        made.T_RIG_CAMERA,
        settings,
    )


def only(observations: Observations, keep: np.ndarray) -> Observations:
    return Observations(**{name: array[keep] for name, array in vars(observations).items()})


def assert_finite(result: Adjustment) -> None:
    for array in (result.states.rotations, result.states.positions, result.points):
        assert np.isfinite(array).all()
    assert result.cost_after <= result.cost_before


@hypothesis_settings(deadline=None, max_examples=15)
@given(st.integers(0, 10_000), st.booleans(), st.booleans())
def test_exact_measurements_lead_back_to_the_truth(seed, depth, inertial):
    problem = made.make(6, 40, 30, seed=seed, noise=False, depth=depth, inertial=inertial)
    roles = made.fixed(problem.states, 2)
    states, points = made.perturbed(problem, roles, seed=seed, share=0.5)
    if not inertial:
        true = problem.states
        states = replace(states, velocities=true.velocities, gyro_biases=true.gyro_biases)
        states = replace(states, accelerometer_biases=true.accelerometer_biases)
    result = run(problem, roles, states, points, WITHOUT_PRIORS)
    # The midpoint rule on 400 Hz samples leaves this much of the inertial motion.
    near = 3e-4 if inertial else 1e-6
    np.testing.assert_allclose(result.states.positions, problem.states.positions, atol=near)
    np.testing.assert_allclose(result.states.rotations, problem.states.rotations, atol=near)
    np.testing.assert_allclose(result.states.velocities, problem.states.velocities, atol=near)
    times_seen = np.bincount(problem.observations.points, minlength=40)
    sure = times_seen >= 3
    np.testing.assert_allclose(result.points[sure], problem.points[sure], atol=10 * near)
    np.testing.assert_allclose(result.residuals_px, 0.0, atol=0.1 if inertial else 1e-3)


def test_inertial_motion_alone_makes_a_map_metric_and_level():
    """One gauge: a map that is 3 % small and 1 deg off level comes right."""
    problem = made.make(10, 120, 60, noise=False)
    true = problem.states
    roles = np.zeros(10, int)
    roles[0] = Role.GAUGE
    tilt = so3.exp(np.radians([0.7, -0.7, 0.0]))
    origin = true.positions[0]
    states = replace(
        true,
        rotations=tilt @ true.rotations,
        positions=origin + 0.97 * (true.positions - origin) @ tilt.T,
        gyro_biases=np.zeros((10, 3)),
        accelerometer_biases=np.zeros((10, 3)),
    )
    points = origin + 0.97 * (problem.points - origin) @ tilt.T
    result = run(problem, roles, states, points, WITHOUT_PRIORS)
    # Position and heading are where they were put, the tilt is not.
    np.testing.assert_allclose(result.states.positions[0], origin, atol=1e-6)
    turn = Rotation.from_matrix(result.states.rotations[0] @ states.rotations[0].T).as_rotvec()
    assert abs(turn[2]) < 1e-7
    length = np.linalg.norm(result.states.positions[-1] - origin)
    assert length == pytest.approx(np.linalg.norm(true.positions[-1] - origin), rel=1e-3)
    down = np.einsum("kji,j->ki", result.states.rotations, [0.0, 0.0, 1.0])
    expected = np.einsum("kji,j->ki", true.rotations, [0.0, 0.0, 1.0])
    np.testing.assert_allclose(down, expected, atol=5e-4)
    np.testing.assert_allclose(result.states.gyro_biases, true.gyro_biases, atol=1e-4)
    np.testing.assert_allclose(
        result.states.accelerometer_biases, true.accelerometer_biases, atol=1e-2
    )


@pytest.mark.parametrize("inertial", [False, True])
def test_errors_are_as_large_as_the_covariance_says(inertial):
    squares = []
    for seed in range(25):
        problem = made.make(5, 60, 40, seed=seed, depth=not inertial, inertial=inertial)
        roles = made.fixed(problem.states, 2)
        states, points = made.perturbed(problem, roles, seed=seed, share=0.3)
        # The fixed keyframes' biases are the truth, but inertial noise is not in them.
        result = run(problem, roles, states, points)
        turn = result.states.rotations[-1] @ problem.states.rotations[-1].T
        error = np.concatenate(
            [result.states.positions[-1] - problem.states.positions[-1], so3.log(turn)]
        )
        squares.append(error @ np.linalg.solve(result.covariance, error))
    # The mean of 25 chi-squared numbers of 6 degrees of freedom: 6 with a sigma of 0.7.
    assert 6 - 2.1 < np.mean(squares) < 6 + 2.8


def test_gross_errors_are_outvoted_and_shown():
    problem = made.make(6, 80, 50, noise=False, inertial=False)
    roles = made.fixed(problem.states, 2)
    pixels = problem.observations.pixels.copy()
    wrong = np.arange(len(pixels)) % 12 == 5
    pixels[wrong] += np.random.default_rng(2).normal(0.0, 60.0, (wrong.sum(), 2))
    problem = replace(problem, observations=replace(problem.observations, pixels=pixels))
    states, points = made.perturbed(problem, roles, share=0.3)
    result = run(problem, roles, states, points)
    trusting = run(problem, roles, states, points, replace(WHOLE, huber=1e6))
    errors = [
        np.linalg.norm(r.states.positions - problem.states.positions) for r in (result, trusting)
    ]
    assert errors[0] < min(0.02, 0.2 * errors[1])
    assert np.median(result.residuals_px[wrong]) > 30.0
    assert np.median(result.residuals_px[~wrong]) < 0.5


def test_without_inertial_factors_velocity_and_biases_stay():
    problem = made.make(5, 40, 30, inertial=False)
    roles = made.fixed(problem.states, 2)
    states, points = made.perturbed(problem, roles)
    result = run(problem, roles, states, points)
    for name in ("velocities", "gyro_biases", "accelerometer_biases"):
        np.testing.assert_array_equal(getattr(result.states, name), getattr(states, name))
    np.testing.assert_array_equal(result.states.positions[:2], states.positions[:2])
    np.testing.assert_array_equal(result.states.rotations[:2], states.rotations[:2])


def test_a_keyframe_that_no_motion_touches_does_no_harm():
    problem = made.make(6, 60, 40)
    problem = replace(problem, inertial=problem.inertial[:3])
    roles = made.fixed(problem.states, 2)
    states, points = made.perturbed(problem, roles)
    result = run(problem, roles, states, points)
    assert_finite(result)
    np.testing.assert_array_equal(result.states.velocities[4:], states.velocities[4:])
    assert np.linalg.norm(result.states.positions[5] - problem.states.positions[5]) < 0.02
    assert result.covariance is not None


def test_a_keyframe_at_rest_does_not_move():
    problem = made.make(5, 60, 40)
    roles = made.fixed(problem.states, 1)
    states, points = made.perturbed(problem, roles)
    still = np.array([False, False, False, False, True])
    # It does move, so that only a claim that is surer than the IMU stops it.
    sure = replace(WHOLE, still_sigma=1e-6)
    free = run(problem, roles, states, points, sure)
    held = run(problem, roles, replace(states, still=still), points, sure)
    assert np.linalg.norm(free.states.velocities[-1]) > 0.3
    assert np.linalg.norm(held.states.velocities[-1]) < 1e-4


def test_a_single_step_of_integration_is_no_singular_motion():
    problem = made.make(4, 60, 40, rate_hz=2.5)
    roles = made.fixed(problem.states, 1)
    states, points = made.perturbed(problem, roles, share=0.2)
    assert_finite(run(problem, roles, states, points))


@pytest.mark.parametrize("inertial", [False, True])
def test_one_free_keyframe(inertial):
    problem = made.make(4, 60, 40, inertial=inertial)
    roles = made.fixed(problem.states, 3)
    states, points = made.perturbed(problem, roles)
    result = run(problem, roles, states, points)
    assert_finite(result)
    assert np.linalg.norm(result.states.positions[3] - problem.states.positions[3]) < 0.02


def test_no_free_keyframe_adjusts_the_points():
    problem = made.make(4, 60, 60, noise=False, inertial=False)
    roles = made.fixed(problem.states, 4)
    states, points = made.perturbed(problem, roles)
    result = run(problem, roles, states, points)
    assert result.covariance is None
    sure = np.bincount(problem.observations.points, minlength=60) >= 2
    np.testing.assert_allclose(result.points[sure], problem.points[sure], atol=1e-5)


def test_a_point_seen_once_moves_onto_its_ray_and_tells_nothing():
    problem = made.make(4, 60, 40, inertial=False)
    roles = made.fixed(problem.states, 2)
    states, points = made.perturbed(problem, roles)
    # Point 0 in one keyframe only; a point 60 without observations.
    o = problem.observations
    first = np.flatnonzero((o.points == 0) & (o.keyframes == o.keyframes[o.points == 0].max()))
    without = replace(problem, observations=only(o, o.points != 0))
    once = replace(problem, observations=only(o, (o.points != 0) | (np.arange(len(o)) == first)))
    points = np.vstack([points, [[1.0, 2.0, 3.0]]])
    result, reference = (run(p, roles, states, points) for p in (once, without))
    assert_finite(result)
    np.testing.assert_allclose(result.states.positions, reference.states.positions, atol=1e-6)
    np.testing.assert_allclose(result.covariance, reference.covariance, rtol=1e-4, atol=1e-12)
    assert result.residuals_px[once.observations.points == 0].max() < 1e-2
    np.testing.assert_array_equal(result.points[60], points[60])


def test_only_outliers_or_nothing_at_all_stays_finite():
    problem = made.make(5, 40, 30)
    roles = made.fixed(problem.states, 2)
    states, points = made.perturbed(problem, roles)
    rng = np.random.default_rng(0)
    o = problem.observations
    nonsense = replace(o, pixels=rng.uniform(0, 480, o.pixels.shape))
    none = only(o, np.zeros(len(o), bool))
    for inertial in (problem.inertial, []):
        for observations in (nonsense, none):
            case = replace(problem, observations=observations, inertial=inertial)
            assert_finite(run(case, roles, states, points))
    assert run(case, roles, states, points).covariance is None


def test_points_behind_the_camera_are_dropped():
    problem = made.make(5, 60, 40, inertial=False)
    roles = made.fixed(problem.states, 2)
    states, points = made.perturbed(problem, roles, share=0.3)
    points[3:6, 2] = 9.0
    result = run(problem, roles, states, points)
    assert_finite(result)
    lost = np.isin(problem.observations.points, [3, 4, 5])
    assert np.isnan(result.residuals_px[lost]).all()
    assert np.isfinite(result.residuals_px[~lost]).all()
    assert np.linalg.norm(result.states.positions[4] - problem.states.positions[4]) < 0.02


def test_an_open_scale_has_no_covariance():
    problem = made.make(5, 60, 40, inertial=False)
    roles = made.fixed(problem.states, 1)
    result = run(problem, roles, *made.perturbed(problem, roles, share=0.3))
    assert_finite(result)
    assert result.covariance is None


def test_the_order_of_the_observations_does_not_matter_to_the_caller():
    problem = made.make(5, 40, 30, depth=True)
    roles = made.fixed(problem.states, 2)
    states, points = made.perturbed(problem, roles)
    order = np.random.default_rng(1).permutation(len(problem.observations))
    shuffled = replace(problem, observations=only(problem.observations, order))
    one, other = run(problem, roles, states, points), run(shuffled, roles, states, points)
    np.testing.assert_allclose(other.residuals_px, one.residuals_px[order], atol=1e-6)
    again = run(problem, roles, states, points)
    assert again.points.tobytes() == one.points.tobytes()


def test_parts_that_do_not_fit_are_named():
    problem = made.make(4, 20, 15)
    roles, o = made.fixed(problem.states, 2), problem.observations
    with pytest.raises(ValueError, match=r"points must lie in 0\.\.9"):
        run(problem, roles, problem.states, problem.points[:10])
    twice = replace(problem, observations=only(o, np.append(np.arange(len(o)), len(o) - 1)))
    with pytest.raises(ValueError, match="twice"):
        run(twice, roles, problem.states, problem.points)
    leap = replace(problem, inertial=[InertialFactor(0, 2, problem.inertial[0].preintegration)])
    with pytest.raises(ValueError, match="factor 0 to 2"):
        run(leap, roles, problem.states, problem.points)
    with pytest.raises(ValueError, match="roles"):
        run(problem, roles + 3, problem.states, problem.points)
    with pytest.raises(ValueError, match="sigmas_px"):
        replace(o, sigmas_px=np.zeros(len(o)))
    bad = problem.states.positions.copy()
    bad[1, 2] = np.nan
    with pytest.raises(ValueError, match="positions: keyframe 1"):
        replace(problem.states, positions=bad)
