"""How a robot goes on: by its IMU, by its gyro alone, or as it went before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airground.core.messages import ImuSamples
from airground.core.se3 import SE3
from airground.slam import so3
from airground.slam.motion_model import ROTATION_SIGMA, MotionModel
from airground.slam.rig_state import RigState
from tests.slam.inertial_motion import ADIS16448, lively, read_imu, to_ns

MOTION = lively(np.random.default_rng(2))
START_S, END_S = 1.0, 1.1
TURN = so3.exp(np.array([0.01, 0.02, -0.03]))


def truth(t: float) -> RigState:
    at = np.array([t])
    return replace(
        RigState.at_origin(MOTION.rotations(at)[0]),
        position=MOTION.position(at)[0],
        velocity=MOTION.velocities(at)[0],
    )


def samples(drop: tuple[float, float] = (9.0, 9.0), clock_ns: int = 0) -> ImuSamples:
    """Perfect ones for 2 s, but none between two times [s]."""
    read = read_imu(MOTION, 2.0, None).samples
    t = read.stamps_ns * 1e-9 - 1.0
    keep = (t <= drop[0]) | (t >= drop[1])
    return ImuSamples(read.stamps_ns[keep] + clock_ns, read.gyro[keep], read.accelerometer[keep])


def model(given: ImuSamples | None, offset_ns: int = 0) -> MotionModel:
    motion = MotionModel(None if given is None else ADIS16448, offset_ns)
    if given is not None:
        motion.add(given)
    return motion


def predict(motion: MotionModel, metric: bool = True):
    start, end = to_ns(np.array([START_S, END_S]))
    return motion.predict(truth(START_S), TURN, int(start), int(end), metric)


def assert_coasts(state: RigState) -> None:
    before = truth(START_S)
    np.testing.assert_allclose(state.position, before.position + 0.1 * before.velocity)
    np.testing.assert_array_equal(state.velocity, before.velocity)


@pytest.mark.parametrize("clock_ns", [0, 3_000_000, -50_000_000])
def test_with_an_imu_the_next_state_is_the_true_one(clock_ns: int) -> None:
    prediction = predict(model(samples(clock_ns=clock_ns), clock_ns))
    after = truth(END_S)
    assert (prediction.inertial, prediction.rotation_sigma) == (True, ROTATION_SIGMA)
    np.testing.assert_allclose(prediction.state.rotation, after.rotation, atol=1e-4)
    np.testing.assert_allclose(prediction.state.position, after.position, atol=1e-4)
    np.testing.assert_allclose(prediction.state.velocity, after.velocity, atol=2e-3)


def test_the_gyro_counts_before_the_unit_is_known() -> None:
    prediction = predict(model(samples()), metric=False)
    assert (prediction.inertial, prediction.rotation_sigma) == (False, ROTATION_SIGMA)
    np.testing.assert_allclose(prediction.state.rotation, truth(END_S).rotation, atol=1e-4)
    assert_coasts(prediction.state)


def test_the_bias_of_the_gyro_is_taken_off() -> None:
    bias = np.array([0.02, -0.01, 0.03])
    read = samples()
    motion = model(ImuSamples(read.stamps_ns, read.gyro + bias, read.accelerometer))
    start, end = to_ns(np.array([START_S, END_S]))
    state = replace(truth(START_S), gyro_bias=bias)
    for metric in (True, False):
        predicted = motion.predict(state, TURN, int(start), int(end), metric).state
        np.testing.assert_allclose(predicted.rotation, truth(END_S).rotation, atol=1e-4)


@pytest.mark.parametrize(
    "given",
    [
        None,
        samples((1.02, 1.08)),
        samples((1.05, 9.0)),
        samples((-1.0, 1.05)),
        ImuSamples(np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3))),
    ],
    ids=["no IMU", "hole", "too early an end", "too late a start", "no samples"],
)
def test_without_samples_it_goes_on_as_before(given: ImuSamples | None) -> None:
    prediction = predict(model(given))
    assert (prediction.inertial, prediction.rotation_sigma) == (False, None)
    np.testing.assert_allclose(prediction.state.rotation, truth(START_S).rotation @ TURN)
    assert_coasts(prediction.state)


def test_a_hole_of_some_samples_is_bridged() -> None:
    prediction = predict(model(samples((1.03, 1.06))))
    assert prediction.inertial
    np.testing.assert_allclose(prediction.state.position, truth(END_S).position, atol=2e-3)


def test_samples_that_are_not_finite_are_a_hole() -> None:
    read = samples()
    t = read.stamps_ns * 1e-9 - 1.0
    gyro = np.where(((t > 1.02) & (t < 1.08))[:, None], np.nan, read.gyro)
    assert not predict(model(ImuSamples(read.stamps_ns, gyro, read.accelerometer))).inertial


def test_samples_from_long_ago_are_forgotten_and_the_motion_stays() -> None:
    motion, whole = model(samples()), model(samples())
    start, end = (int(s) for s in to_ns(np.array([1.5, 1.7])))
    assert motion.buffer is not None
    motion.forget_before(start)
    # 2 s at 200 Hz were there; what is left begins a second before.
    assert 300 <= len(motion.buffer) <= 302
    state = truth(1.5)
    kept, all_of = (m.preintegrate(start, end, state) for m in (motion, whole))
    assert kept is not None
    assert all_of is not None
    np.testing.assert_array_equal(kept.position, all_of.position)
    assert motion.preintegrate(*(int(s) for s in to_ns(np.array([0.1, 0.2]))), state) is None


def test_a_measured_pose_brings_its_velocity_unless_inertia_knows_better() -> None:
    motion, before, there = model(samples()), truth(START_S), truth(END_S)
    by_inertia = motion.measured(before, predict(motion), there.pose(), 0.1)
    np.testing.assert_allclose(by_inertia.velocity, there.velocity, atol=1e-3)
    unmetric = predict(motion, metric=False)
    by_the_way = motion.measured(before, unmetric, there.pose(), 0.1)
    np.testing.assert_allclose(by_the_way.velocity, (there.position - before.position) / 0.1)
    after_a_blind_image = motion.measured(before, unmetric, there.pose(), None)
    np.testing.assert_array_equal(after_a_blind_image.velocity, np.zeros(3))
    for state in (by_inertia, by_the_way, after_a_blind_image):
        np.testing.assert_array_equal(state.position, there.position)
        np.testing.assert_allclose(state.rotation, there.rotation, atol=1e-12)


def test_a_hand_held_camera_is_expected_near_where_its_last_steps_lead() -> None:
    start, end = (int(stamp) for stamp in to_ns(np.array([START_S, END_S])))
    before = truth(START_S)
    motion = model(None)
    lost = motion.predict(before, TURN, start, end, False, False)
    known = motion.predict(before, TURN, start, end, False, True)
    assert lost.position_sigma is None
    assert known.position_sigma is not None
    later = start + round(1e9 / 30)
    soon = motion.predict(before, TURN, start, later, False, True).position_sigma
    assert soon is not None
    assert 0.003 < soon < 0.006 < known.position_sigma < 0.05  # 5 mm at 30 Hz, more after 0.1 s
    # A step that was measured wrong counts half.
    there = SE3(before.rotation, before.position + 0.1 * before.velocity + [0.02, 0.0, 0.0])
    after = motion.measured(before, known, there, 0.1)
    np.testing.assert_allclose(after.velocity - before.velocity, [0.1, 0.0, 0.0], atol=1e-9)
