"""Preintegration against exact motion, finite differences, a slow twin, noise draws and GTSAM."""

import itertools

import gtsam
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airground.core.messages import ImuSamples
from airground.errors import InputError
from airground.slam import so3
from airground.slam.inertial.preintegration import GRAVITY, ImuBuffer, Preintegration
from tests.slam.inertial_motion import ADIS16448, lively, read_imu, to_ns

ZERO = np.zeros(3)


def buffer_of(samples: ImuSamples) -> ImuBuffer:
    buffer = ImuBuffer(ADIS16448)
    buffer.add(samples)
    return buffer


def slow_sum(samples, start, end, gyro_bias, force_bias):
    """Rotation, velocity, position by the book: SciPy's rotations, one step after another."""

    def at(stamp):
        return [
            np.array([np.interp(stamp, samples.stamps_ns, column) for column in table.T])
            for table in (samples.gyro - gyro_bias, samples.accelerometer - force_bias)
        ]

    inside = samples.stamps_ns[(samples.stamps_ns > start) & (samples.stamps_ns < end)]
    stamps = [start, *inside, end]
    R, v, p = np.eye(3), np.zeros(3), np.zeros(3)
    for this, following in itertools.pairwise(stamps):
        dt = (following - this) * 1e-9
        (w0, a0), (w1, a1) = at(this), at(following)
        turned = R @ Rotation.from_rotvec(dt * (w0 + w1) / 2).as_matrix()
        a = (R @ a0 + turned @ a1) / 2
        R, v, p = turned, v + dt * a, p + dt * v + dt**2 * a / 2
    return R, v, p


@pytest.mark.kernel
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("seconds", [(0.0102, 0.0431), (0.1, 0.6), (0.0011, 0.0042), (-0.01, 1.2)])
def test_sums_like_the_slow_twin(seed, seconds):
    rng = np.random.default_rng(seed)
    samples = read_imu(lively(rng), 1.0, rng).samples
    kept = rng.random(len(samples.stamps_ns)) > 0.2  # holes
    samples = ImuSamples(samples.stamps_ns[kept], samples.gyro[kept], samples.accelerometer[kept])
    start, end = (int(s) for s in to_ns(np.array(seconds)))
    biases = rng.normal(0, 0.1, (2, 3))
    motion = buffer_of(samples).preintegrate(start, end, *biases)
    for fast, slow in zip(
        (motion.rotation, motion.velocity, motion.position),
        slow_sum(samples, start, end, *biases),
        strict=True,
    ):
        np.testing.assert_allclose(fast, slow, atol=1e-12)


@pytest.mark.parametrize("rate_hz", [200.0, 1000.0])
@pytest.mark.parametrize("seed", range(3))
def test_predicts_the_exact_motion(seed, rate_hz):
    """With an error that falls with the square of the rate."""
    tolerance = (2.5 / rate_hz) ** 2
    motion = lively(np.random.default_rng(seed))
    buffer = buffer_of(read_imu(motion, 3.0, None, rate_hz=rate_hz).samples)
    t = np.array([0.3, 2.3])
    sums = buffer.preintegrate(*to_ns(t), ZERO, ZERO)
    R, p, v = motion.rotations(t), motion.position(t), motion.velocities(t)
    rotation, position, velocity = sums.predict(R[0], p[0], v[0], ZERO, ZERO)
    assert np.linalg.norm(so3.log(R[1].T @ rotation)) < tolerance
    np.testing.assert_allclose(velocity, v[1], atol=5 * tolerance)
    np.testing.assert_allclose(position, p[1], atol=5 * tolerance)


@pytest.mark.parametrize("seed", range(3))
def test_bias_jacobians_are_the_finite_differences(seed):
    rng = np.random.default_rng(seed)
    buffer = buffer_of(read_imu(lively(rng), 2.0, rng).samples)
    start, end = 1_203_000_000, 1_777_000_000
    biases = rng.normal(0, 0.05, (2, 3))
    here = buffer.preintegrate(start, end, *biases)
    step = 1e-5
    for axis in range(3):
        for sensor in range(2):
            shift = np.zeros((2, 3))
            shift[sensor, axis] = step
            above = buffer.preintegrate(start, end, *(biases + shift))
            below = buffer.preintegrate(start, end, *(biases - shift))
            turn = so3.log(below.rotation.T @ above.rotation) / (2 * step)
            velocity = (above.velocity - below.velocity) / (2 * step)
            position = (above.position - below.position) / (2 * step)
            by = (
                (here.rotation_by_gyro_bias, here.velocity_by_gyro_bias, here.position_by_gyro_bias)
                if sensor == 0
                else (
                    np.zeros((3, 3)),
                    here.velocity_by_accelerometer_bias,
                    here.position_by_accelerometer_bias,
                )
            )
            np.testing.assert_allclose(by[0][:, axis], turn, atol=1e-8)
            np.testing.assert_allclose(by[1][:, axis], velocity, atol=1e-7)
            np.testing.assert_allclose(by[2][:, axis], position, atol=1e-7)


def test_correction_is_as_good_as_integrating_again():
    rng = np.random.default_rng(1)
    buffer = buffer_of(read_imu(lively(rng), 1.0, rng).samples)
    start, end = 1_100_000_000, 1_600_000_000
    gyro, force = np.array([0.01, -0.005, 0.008]), np.array([0.1, 0.05, -0.08])
    corrected = buffer.preintegrate(start, end, ZERO, ZERO).corrected(gyro, force)
    again = buffer.preintegrate(start, end, gyro, force)
    np.testing.assert_allclose(corrected[0], again.rotation, atol=1e-5)
    np.testing.assert_allclose(corrected[1], again.velocity, atol=4e-4)
    np.testing.assert_allclose(corrected[2], again.position, atol=1e-4)


def errors_of(noisy: Preintegration, exact: Preintegration) -> np.ndarray:
    return np.concatenate(
        [
            so3.log(exact.rotation.T @ noisy.rotation),
            noisy.velocity - exact.velocity,
            noisy.position - exact.position,
        ]
    )


@pytest.mark.slow
def test_covariance_is_that_of_noise_draws():
    motion = lively(np.random.default_rng(4))
    start, end = to_ns(np.array([0.2, 0.9]))
    exact = buffer_of(read_imu(motion, 1.0, None).samples).preintegrate(start, end, ZERO, ZERO)
    rng = np.random.default_rng(5)
    samples = read_imu(motion, 1.0, None).samples
    errors = []
    for _ in range(2000):
        gyro = samples.gyro + rng.normal(0, ADIS16448.gyro_noise_density * 200**0.5, (201, 3))
        force = samples.accelerometer + rng.normal(
            0, ADIS16448.accelerometer_noise_density * 200**0.5, (201, 3)
        )
        noisy = buffer_of(ImuSamples(samples.stamps_ns, gyro, force))
        errors.append(errors_of(noisy.preintegrate(start, end, ZERO, ZERO), exact))
    whitened = np.linalg.solve(np.linalg.cholesky(exact.covariance), np.array(errors).T)
    # 2000 draws leave about 3 % in each of them.
    np.testing.assert_allclose(whitened @ whitened.T / 2000, np.eye(9), atol=0.12)


def test_agrees_with_gtsam():
    """GTSAM does not turn the force within a step: both meet at a high rate."""
    rate = 4000.0
    motion = lively(np.random.default_rng(2))
    samples = read_imu(motion, 0.5, None, rate_hz=rate).samples
    biases = np.array([[0.02, -0.01, 0.015], [0.1, -0.2, 0.05]])
    ours = buffer_of(samples).preintegrate(1_000_000_000, 1_500_000_000, *biases)
    parameters = gtsam.PreintegrationParams.MakeSharedU(GRAVITY)
    parameters.setGyroscopeCovariance(ADIS16448.gyro_noise_density**2 * np.eye(3))
    parameters.setAccelerometerCovariance(ADIS16448.accelerometer_noise_density**2 * np.eye(3))
    parameters.setIntegrationCovariance(np.zeros((3, 3)))
    theirs = gtsam.PreintegratedImuMeasurements(
        parameters, gtsam.imuBias.ConstantBias(biases[1], biases[0])
    )
    gyros, forces = (a[:-1] / 2 + a[1:] / 2 for a in (samples.gyro, samples.accelerometer))
    for gyro, force in zip(gyros, forces, strict=True):
        theirs.integrateMeasurement(force, gyro, 1 / rate)
    np.testing.assert_allclose(ours.rotation, theirs.deltaRij().matrix(), atol=1e-4)
    np.testing.assert_allclose(ours.velocity, theirs.deltaVij(), atol=1e-3)
    np.testing.assert_allclose(ours.position, theirs.deltaPij(), atol=5e-4)
    # Theirs is in the order rotation, position, velocity, and of the rotation vector itself.
    to_ours = np.eye(9)[np.r_[0:3, 6:9, 3:6]]
    to_ours[:3, :3] = so3.right_jacobian(so3.log(ours.rotation))
    covariance = to_ours @ theirs.preintMeasCov() @ to_ours.T
    scale = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        ours.covariance / np.outer(scale, scale), covariance / np.outer(scale, scale), atol=3e-3
    )
    start = gtsam.NavState(gtsam.Rot3(), np.array([1.0, 2, 3]), np.array([0.1, 0.2, 0.3]))
    end = theirs.predict(start, gtsam.imuBias.ConstantBias(biases[1] + 0.01, biases[0] - 0.01))
    rotation, position, velocity = ours.predict(
        np.eye(3), start.position(), start.velocity(), biases[0] - 0.01, biases[1] + 0.01
    )
    np.testing.assert_allclose(rotation, end.attitude().matrix(), atol=1e-4)
    np.testing.assert_allclose(position, end.position(), atol=5e-4)
    np.testing.assert_allclose(velocity, end.velocity(), atol=1e-3)


def test_gaps_and_cover():
    stamps = np.array([0, 5, 10, 60, 65, 70], np.int64) * 1_000_000
    buffer = buffer_of(ImuSamples(stamps, np.zeros((6, 3)), np.zeros((6, 3))))
    ms = 1_000_000

    def gap(start: int, end: int) -> float:
        return buffer.preintegrate(start * ms, end * ms, ZERO, ZERO).longest_gap_s

    assert gap(2, 9) == pytest.approx(0.005)
    assert gap(20, 30) == pytest.approx(0.050)  # wholly inside the hole
    assert gap(61, 78) == pytest.approx(0.008)  # held beyond the newest
    assert buffer.covers(0, 70 * ms)
    assert buffer.covers(0, 85 * ms)
    assert not buffer.covers(0, 100 * ms)
    assert not buffer.covers(-30 * ms, 70 * ms)


def test_holds_all_samples_and_forgets_the_old():
    rng = np.random.default_rng(0)
    stamps = np.arange(20_000, dtype=np.int64) * 5_000_000
    gyro, force = rng.normal(size=(2, 20_000, 3))
    buffer = ImuBuffer(ADIS16448)
    for lo in range(0, 20_000, 7):
        run = slice(lo, lo + 7)
        buffer.add(ImuSamples(stamps[run], gyro[run], force[run]))
    assert len(buffer) == 20_000
    assert buffer.newest_ns == stamps[-1]
    start, end = 90_001_000_000, 90_300_000_000
    before = buffer.preintegrate(start, end, ZERO, ZERO)
    buffer.forget_before(start)
    after = buffer.preintegrate(start, end, ZERO, ZERO)
    np.testing.assert_array_equal(before.position, after.position)
    assert len(buffer) == 2000
    gyro_mean, _ = buffer.mean_between(start, end)
    inside = (stamps > start) & (stamps <= end)
    np.testing.assert_allclose(gyro_mean, gyro[inside].mean(axis=0))
    assert buffer.mean_between(0, 10) is None


def test_missing_readings_are_a_gap_and_order_matters():
    stamps = np.arange(5, dtype=np.int64) * 5_000_000
    gyro = np.zeros((5, 3))
    gyro[2, 1] = np.nan
    buffer = buffer_of(ImuSamples(stamps, gyro, np.zeros((5, 3))))
    assert buffer.preintegrate(0, 20_000_000, ZERO, ZERO).longest_gap_s == pytest.approx(0.01)
    with pytest.raises(InputError, match="stamps must increase"):
        buffer.add(ImuSamples(stamps, np.zeros((5, 3)), np.zeros((5, 3))))
    with pytest.raises(ValueError, match="nothing to integrate"):
        buffer.preintegrate(10, 10, ZERO, ZERO)
