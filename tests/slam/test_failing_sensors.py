"""Cameras that repeat images and IMUs that are dead or saturated lead to no wrong pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airground.core.cloud import Source
from airground.core.messages import ImuSamples
from airground.slam.inertial.failed_samples import FailedSamples
from tests.slam import hard_sequences as hard
from tests.slam.hard_sequences import Leg, image_range
from tests.slam.inertial_motion import lively, read_imu
from tests.slam.synthetic_world import START_NS, Sequence
from tests.slam.test_robustness import (
    LOST,
    TRACKED,
    TROUBLE_S,
    assert_no_silent_jump,
    both_robots,
    sequence_of,
    states,
    tracked_by,
)

FULL_SCALE = np.repeat([np.deg2rad(250.0), 2 * 9.81], 3)
CALM = np.array([0.1, -0.2, 0.3, 0.5, -1.0, 9.7])


def samples(readings: np.ndarray, first: int = 0) -> ImuSamples:
    """At 200 Hz, with the number of the first one."""
    stamps = (first + np.arange(len(readings), dtype=np.int64)) * 5_000_000
    return ImuSamples(stamps, readings[:, :3], readings[:, 3:])


def readings(count: int, seed: int = 0) -> np.ndarray:
    return CALM + np.random.default_rng(seed).normal(0.0, 0.02, (count, 6))


@pytest.mark.parametrize("run", [1, 7, 200])
def test_samples_of_zero_and_at_full_scale_are_found_whatever_the_messages(run: int) -> None:
    """100 good ones, 40 of zero, 30 good, 40 saturated, and 50 good."""
    made = readings(260)
    made[100:140] = 0.0
    made[170:210] = np.copysign(FULL_SCALE, made[170:210])
    good = np.ones(260, bool)
    good[100:140] = good[170:210] = False
    failed = FailedSamples()
    parts = [
        failed.measured(samples(made[first : first + run], first)) for first in range(0, 260, run)
    ]
    np.testing.assert_array_equal(np.concatenate(parts), good)


def test_one_axis_at_its_end_is_found_from_the_third_sample_on() -> None:
    made = readings(60)
    made[30:40, 5] = 2 * 9.81
    measured = FailedSamples().measured(samples(made))
    np.testing.assert_array_equal(np.flatnonzero(~measured), np.arange(30, 40))


@pytest.mark.parametrize("seed", range(3))
def test_lively_motion_and_rest_without_noise_are_measured(seed: int) -> None:
    rng = np.random.default_rng(seed)
    lifelike = read_imu(lively(rng), 3.0, rng).samples
    fast = ImuSamples(lifelike.stamps_ns, 4 * lifelike.gyro, 2 * lifelike.accelerometer)
    assert np.abs(fast.gyro).max() > 1.0
    assert FailedSamples().measured(fast).all()
    assert FailedSamples().measured(samples(np.tile([0, 0, 0, 0, 0, 9.81], (50, 1)))).all()


def failing_imu(sequence: Sequence, start_s: float, end_s: float, saturated: bool) -> Sequence:
    """Inertial samples of zero, or at full scale, for a while."""
    imu = sequence.imu
    seconds = (imu.stamps_ns - START_NS) * 1e-9
    rows = (seconds >= start_s) & (seconds < end_s)
    parts = [np.array(imu.gyro), np.array(imu.accelerometer)]
    for part, scale in zip(parts, (FULL_SCALE[:3], FULL_SCALE[3:]), strict=True):
        part[rows] = np.copysign(scale, part[rows]) if saturated else 0.0
    return replace(sequence, imu=ImuSamples(imu.stamps_ns, *parts))


def frozen(sequence: Sequence, start_s: float, end_s: float) -> Sequence:
    """The last image before, again and again with new stamps."""
    held = image_range(sequence, start_s, end_s)
    images = [
        replace(sequence.images[held.start - 1], stamp_ns=image.stamp_ns) if k in held else image
        for k, image in enumerate(sequence.images)
    ]
    return replace(sequence, images=tuple(images))


@both_robots
@pytest.mark.parametrize("seconds", [0.1, 0.5, np.inf])
@pytest.mark.parametrize("saturated", [False, True], ids=["silent", "saturated"])
def test_a_failing_imu_does_not_matter(robot: Source, seconds: float, saturated: bool) -> None:
    t = TROUBLE_S[robot]
    sequence = failing_imu(sequence_of(robot), t, t + seconds, saturated)
    tracked = tracked_by(sequence)
    assert_no_silent_jump(sequence, tracked)
    assert set(states(tracked, t)) == {TRACKED}


@pytest.mark.parametrize("seconds", [0.1, 1.0])
def test_frozen_images_have_no_pose(seconds: float) -> None:
    t = TROUBLE_S[Source.MAV]
    sequence = frozen(sequence_of(Source.MAV), t, t + seconds)
    tracked = tracked_by(sequence)
    assert_no_silent_jump(sequence, tracked)
    assert set(states(tracked, t, t + seconds)) == {LOST}
    assert TRACKED in states(tracked, t + seconds, t + seconds + 0.3)
    assert tracked[-1].tracking is TRACKED


@both_robots
def test_every_second_image_twice(robot: Source) -> None:
    t = TROUBLE_S[robot]
    whole = sequence_of(robot)
    sequence = whole
    for k in image_range(whole, t, t + 1.0)[::2]:
        start_s = (whole.images[k].stamp_ns - START_NS) * 1e-9
        sequence = frozen(sequence, start_s, start_s + 0.5 / hard.HZ)
    tracked = tracked_by(sequence)
    assert_no_silent_jump(sequence, tracked)
    during = states(tracked, t, t + 1.0)
    assert set(during[::2]) == {LOST}
    assert set(during[1::2]) == {TRACKED}


def test_equal_images_of_a_robot_at_rest_are_tracked() -> None:
    """As of a camera without noise."""
    sequence = frozen(hard.drive(Leg(3.0)), 0.1, np.inf)
    tracked = tracked_by(sequence)
    assert_no_silent_jump(sequence, tracked)
    assert {pose.tracking for pose in tracked} == {TRACKED}
