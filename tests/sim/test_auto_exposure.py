"""Automatic exposure follows light as its parameters say: late, with overshoot, within limits."""

from dataclasses import replace

import numpy as np
import pytest

from airground.errors import InputError
from sim.sensors.auto_exposure import (
    CONSUMER_EXPOSURE,
    WHITE,
    AutoExposure,
    Exposure,
    ExposureCourse,
    regulate,
)
from sim.sensors.presets import NOMINAL, NONE, REAL
from sim.sensors.turned import with_auto_exposure, with_gamma

RATE_HZ = 30.0
FIXED_S = 0.005
STEP = 20
"""Image at which light changes."""
COUNT = 200
TIMES_NS = np.rint(np.arange(COUNT) * 1e9 / RATE_HZ).astype(np.int64)


def of_levels(levels: np.ndarray) -> np.ndarray:
    """(N, 256) histograms of images that have one grey level each."""
    histograms = np.zeros((len(levels), 256))
    histograms[np.arange(len(levels)), levels] = 1.0
    return histograms


def stepped(before: int, after: int, auto: AutoExposure = CONSUMER_EXPOSURE) -> ExposureCourse:
    levels = np.where(np.arange(COUNT) < STEP, before, after)
    return regulate(auto, FIXED_S, RATE_HZ, TIMES_NS, of_levels(levels))


def logs(course: ExposureCourse) -> np.ndarray:
    """(N,) logarithms of the factor on the light."""
    return np.log(course.exposure_s * course.gain / FIXED_S)


@pytest.mark.parametrize("damping", [0.3, 0.5, 0.8])
@pytest.mark.parametrize("delay", [1, 2, 5])
def test_a_step_of_light_is_followed_as_a_damped_spring_follows(damping: float, delay: int) -> None:
    auto = replace(CONSUMER_EXPOSURE, damping=damping, delay_frames=delay)
    found = logs(stepped(100, 50, auto))
    start, end = np.log(auto.target / 100), np.log(auto.target / 50)
    # The first image of which the new light can be a cause is `delay` after the step.
    after_s = np.maximum(np.arange(COUNT) - (STEP + delay - 1), 0) / RATE_HZ
    natural = 2 * np.pi * auto.frequency_hz
    damped = natural * np.sqrt(1 - damping**2)
    wave = np.cos(damped * after_s) + damping * natural / damped * np.sin(damped * after_s)
    expected = end + (start - end) * np.exp(-damping * natural * after_s) * wave
    np.testing.assert_allclose(found, expected, atol=1e-9)
    overshoot = (found.max() - end) / (end - start)
    assert overshoot == pytest.approx(np.exp(-np.pi * damping / np.sqrt(1 - damping**2)), abs=0.01)
    settled = after_s > np.log(1 / 0.02 / np.sqrt(1 - damping**2)) / (damping * natural)
    assert np.abs(found[settled] - end).max() <= 0.02 * (end - start)


def test_the_overshoot_of_real_is_what_its_comment_says() -> None:
    found = logs(stepped(100, 50))
    share = (found - found[0]) / np.log(2)
    assert share.max() == pytest.approx(1.16, abs=0.01)
    passed_s = (int(np.flatnonzero(share >= 1)[0]) - (STEP + 1)) / RATE_HZ
    assert passed_s == pytest.approx(0.38, abs=1 / RATE_HZ)


def test_a_longer_exposure_comes_before_gain() -> None:
    course = stepped(100, 10)
    _, longest = CONSUMER_EXPOSURE.exposure_s
    assert (course.gain[course.exposure_s < longest] == 1).all()
    assert (course.exposure_s[course.gain > 1] == longest).all()
    needed = CONSUMER_EXPOSURE.target / 10 * FIXED_S / longest
    assert course.gain[-1] == pytest.approx(needed, rel=1e-3)
    assert course.gain.max() > 1.3 * needed


@pytest.mark.parametrize(("before", "after"), [(100, 0), (0, 255), (255, 1)])
def test_limits_hold(before: int, after: int) -> None:
    auto = replace(CONSUMER_EXPOSURE, exposure_s=(0.004, 0.010), max_gain=2.0)
    course = stepped(before, after, auto)
    assert course.exposure_s.min() >= 0.004
    assert course.exposure_s.max() <= 0.010
    assert course.gain.min() >= 1.0
    assert course.gain.max() <= 2.0
    ends = {0: (0.010, 2.0), 255: (0.004, 1.0), 1: (0.010, 2.0)}[after]
    assert (course.exposure_s[-1], course.gain[-1]) == pytest.approx(ends)


def test_what_is_white_tells_less_than_how_bright_it_is() -> None:
    """Light that is 25 times as bright saturates the first images; each image that is white asks
    for a darker one by the same factor, until levels are seen again."""
    course = stepped(10, 250)
    shown = np.minimum(np.where(np.arange(COUNT) < STEP, 10, 250) * np.exp(logs(course)), WHITE)
    assert shown[STEP - 1] == pytest.approx(CONSUMER_EXPOSURE.target, rel=1e-3)
    white = shown[STEP:] == WHITE
    assert white[:3].all()
    assert not white[int(RATE_HZ) :].any()
    assert shown[-1] == pytest.approx(CONSUMER_EXPOSURE.target, rel=0.01)
    # An image below white would have been followed at once, to the same end.
    assert logs(course)[STEP + 4] > logs(stepped(2, 50))[STEP + 4] - np.log(5)


def test_half_the_strength_makes_half_the_correction_in_stops() -> None:
    whole, half = stepped(100, 60), stepped(100, 60, replace(CONSUMER_EXPOSURE, strength=0.5))
    np.testing.assert_allclose(logs(half), 0.5 * logs(whole), atol=1e-9)
    none = stepped(100, 60, replace(CONSUMER_EXPOSURE, strength=0.0))
    np.testing.assert_array_equal(none.gain, 1.0)
    np.testing.assert_allclose(none.exposure_s, FIXED_S, rtol=1e-12)


def test_it_starts_settled_where_a_part_of_the_image_is_white() -> None:
    histogram = np.zeros((COUNT, 256))
    histogram[:, [20, 255]] = 0.7, 0.3
    course = regulate(CONSUMER_EXPOSURE, FIXED_S, RATE_HZ, TIMES_NS, histogram)
    factor = np.exp(logs(course))
    assert np.ptp(factor) < 1e-6
    shown = 0.7 * np.minimum(20 * factor[0], WHITE) + 0.3 * WHITE
    assert shown == pytest.approx(CONSUMER_EXPOSURE.target, rel=1e-6)


def test_later_images_change_nothing_before_them() -> None:
    whole, cut = stepped(100, 50), of_levels(np.full(STEP + 2, 100))
    short = regulate(CONSUMER_EXPOSURE, FIXED_S, RATE_HZ, TIMES_NS[: STEP + 2], cut)
    np.testing.assert_array_equal(short.exposure_s, whole.exposure_s[: STEP + 2])


def test_the_nearest_image_is_found() -> None:
    course = ExposureCourse(np.array([0, 33, 67]), np.array([0.1, 0.2, 0.3]), np.array([1.0, 2, 3]))
    assert course.at(40) == Exposure(0.2, 2.0)
    assert course.at(1000) == Exposure(0.3, 3.0)


@pytest.mark.parametrize(
    "change",
    [
        {"target": 0.0},
        {"exposure_s": (0.02, 0.01)},
        {"max_gain": 0.5},
        {"delay_frames": 0},
        {"frequency_hz": 0.0},
        {"damping": -0.1},
        {"strength": 1.5},
    ],
)
def test_impossible_parameters_are_refused(change: dict[str, object]) -> None:
    with pytest.raises(InputError, match=f"automatic exposure: {next(iter(change))}"):
        replace(CONSUMER_EXPOSURE, **change)  # type: ignore[arg-type]


def test_dials() -> None:
    assert with_auto_exposure(NOMINAL, 0.0) == NOMINAL
    assert with_auto_exposure(REAL, 1.0) == REAL
    assert with_auto_exposure(REAL, 0.0).exposure is None
    assert with_gamma(NOMINAL, 1.0) == NOMINAL
    assert with_gamma(NONE, 1.0) == NONE
    assert with_auto_exposure(NONE, 0.0) == NONE
    for turn in (with_auto_exposure, with_gamma):
        with pytest.raises(InputError, match="sensors 'none' cannot have"):
            turn(NONE, 0.5)
