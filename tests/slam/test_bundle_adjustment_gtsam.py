"""The same problem given to GTSAM, whose factors and optimizer are not ours."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from gtsam.symbol_shorthand import B, L, V, X

from airground.slam import so3
from airground.slam.bundle_adjustment import InertialFactor, Observations, Settings, adjust
from airground.slam.inertial.preintegration import GRAVITY, ImuBuffer
from tests.slam import bundle_problems as made

HUBER = 1.5
EXACT = 1e-7
"""Sigma that holds a fixed keyframe in GTSAM."""
SETTINGS = Settings(iterations=40, huber=HUBER, relative_decrease=1e-13)
INTERVAL_S, RATE_HZ = 0.4, 400.0


def motion(samples, start_s: float, end_s: float):
    """GTSAM's sum of the samples, given the means over each step as ours takes them."""
    params = gtsam.PreintegrationParams.MakeSharedU(GRAVITY)
    params.setGyroscopeCovariance(made.NOISE.gyro_noise_density**2 * np.eye(3))
    params.setAccelerometerCovariance(made.NOISE.accelerometer_noise_density**2 * np.eye(3))
    params.setIntegrationCovariance(1e-14 * np.eye(3))
    force_bias, turn_bias = 0.9 * made.ACCELEROMETER_BIAS, 0.9 * made.GYRO_BIAS
    total = gtsam.PreintegratedImuMeasurements(
        params, gtsam.imuBias.ConstantBias(force_bias, turn_bias)
    )
    times = samples.stamps_ns * 1e-9
    inside = times[(times > start_s + 1e-6) & (times < end_s - 1e-6)]
    times_s = np.concatenate([[start_s], inside, [end_s]])
    gyro = np.array([np.interp(times_s, times, axis) for axis in samples.gyro.T]).T
    force = np.array([np.interp(times_s, times, axis) for axis in samples.accelerometer.T]).T
    for n in range(len(times_s) - 1):
        dt = times_s[n + 1] - times_s[n]
        rate = 0.5 * (gyro[n] + gyro[n + 1])
        turn = so3.exp(dt * (rate - turn_bias))
        # The mean of the forces at both ends, in the frame of the first.
        mean = 0.5 * (force[n] - force_bias + turn @ (force[n + 1] - force_bias))
        total.integrateMeasurement(mean + force_bias, rate, dt)
    return total


def visual_factors(problem, graph) -> None:
    calibration = gtsam.Cal3_S2(made.CAMERA.fx, made.CAMERA.fy, 0.0, made.CAMERA.cx, made.CAMERA.cy)
    mounting = gtsam.Pose3(made.T_RIG_CAMERA.matrix())
    pixel = gtsam.noiseModel.Robust.Create(
        gtsam.noiseModel.mEstimator.Huber.Create(HUBER),
        gtsam.noiseModel.Isotropic.Sigma(2, made.SIGMA_PX),
    )
    o = problem.observations
    for k, j, uv in zip(o.keyframes, o.points, o.pixels, strict=True):
        graph.add(
            gtsam.GenericProjectionFactorCal3_S2(uv, pixel, X(k), L(j), calibration, mounting)
        )


def inertial_factors(count: int, graph) -> list[InertialFactor]:
    """Adds GTSAM's and returns ours, from the same noisy samples."""
    end_s = made.START_S + INTERVAL_S * (count - 1)
    samples = made.imu_samples(end_s, RATE_HZ, np.random.default_rng(0))
    buffer = ImuBuffer(made.NOISE)
    buffer.add(samples)
    biases = 0.9 * made.GYRO_BIAS, 0.9 * made.ACCELEROMETER_BIAS
    ours = []
    for k in range(count - 1):
        start_s, end_s = (made.START_S + INTERVAL_S * n for n in (k, k + 1))
        summed = buffer.preintegrate(round(start_s * 1e9), round(end_s * 1e9), *biases)
        ours.append(InertialFactor(k, k + 1, summed))
        theirs = motion(samples, start_s, end_s)
        graph.add(gtsam.ImuFactor(X(k), V(k), X(k + 1), V(k + 1), B(k), theirs))
        walk = np.repeat([summed.accelerometer_bias_sigma, summed.gyro_bias_sigma], 3)
        walking = gtsam.noiseModel.Diagonal.Sigmas(walk)
        still = gtsam.imuBias.ConstantBias()
        graph.add(gtsam.BetweenFactorConstantBias(B(k), B(k + 1), still, walking))
    return ours


def start_values(states, points, seen) -> gtsam.Values:
    values = gtsam.Values()
    for k in range(len(states)):
        pose = gtsam.Pose3(gtsam.Rot3(states.rotations[k]), states.positions[k])
        values.insert(X(k), pose)
        values.insert(V(k), states.velocities[k])
        bias = states.accelerometer_biases[k], states.gyro_biases[k]
        values.insert(B(k), gtsam.imuBias.ConstantBias(*bias))
    for j in seen:
        values.insert(L(j), points[j])
    return values


def hold(graph, values, k: int) -> None:
    """A fixed keyframe, by tight priors."""
    graph.addPriorPose3(X(k), values.atPose3(X(k)), gtsam.noiseModel.Isotropic.Sigma(6, EXACT))
    tight = gtsam.noiseModel.Isotropic.Sigma(3, EXACT)
    graph.addPriorVector(V(k), values.atVector(V(k)), tight)
    tight = gtsam.noiseModel.Isotropic.Sigma(6, EXACT)
    graph.addPriorConstantBias(B(k), values.atConstantBias(B(k)), tight)


def test_the_optimum_and_its_covariance_are_those_of_gtsam():
    problem = made.make(6, 50, 30, seed=5, interval_s=INTERVAL_S, inertial=False)
    o = problem.observations
    twice = np.bincount(o.points, minlength=50)[o.points] > 1
    o = Observations(**{name: array[twice] for name, array in vars(o).items()})
    problem = replace(problem, observations=o)
    roles = made.fixed(problem.states, 1)
    states, points = made.perturbed(problem, roles, share=0.5)
    graph = gtsam.NonlinearFactorGraph()
    visual_factors(problem, graph)
    ours = inertial_factors(len(roles), graph)
    values = start_values(states, points, np.unique(o.points))
    hold(graph, values, 0)
    params = gtsam.LevenbergMarquardtParams()
    params.setRelativeErrorTol(1e-14)
    params.setAbsoluteErrorTol(1e-12)
    params.setMaxIterations(200)
    best = gtsam.LevenbergMarquardtOptimizer(graph, values, params).optimize()

    result = adjust(states, roles, points, o, ours, made.CAMERA, made.T_RIG_CAMERA, SETTINGS)
    assert result.cost_after == pytest.approx(graph.error(best), rel=1e-4)
    sigmas = np.sqrt(np.diag(result.covariance))
    for k in range(1, len(roles)):
        pose = best.atPose3(X(k))
        off = result.states.positions[k] - pose.translation()
        turned = so3.log(result.states.rotations[k] @ pose.rotation().matrix().T)
        assert (np.abs(off) < 0.02 * sigmas[:3]).all()
        assert (np.abs(turned) < 0.02 * sigmas[3:]).all()
        np.testing.assert_allclose(result.states.velocities[k], best.atVector(V(k)), atol=1e-4)
        bias = best.atConstantBias(B(k))
        np.testing.assert_allclose(result.states.gyro_biases[k], bias.gyroscope(), atol=1e-5)
        np.testing.assert_allclose(
            result.states.accelerometer_biases[k], bias.accelerometer(), atol=1e-3
        )
    for j in np.unique(o.points):
        np.testing.assert_allclose(result.points[j], best.atPoint3(L(j)), atol=1e-3)

    last = len(roles) - 1
    theirs = gtsam.Marginals(graph, best).marginalCovariance(X(last))
    # GTSAM's order is rotation, position, both in the rig's axes.
    turn = np.zeros((6, 6))
    turn[0:3, 3:6] = turn[3:6, 0:3] = best.atPose3(X(last)).rotation().matrix()
    expected = turn @ theirs @ turn.T
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(result.covariance / scale, expected / scale, atol=0.02)
