"""How maps begin: level, at rest, or between two views; the camera is in the origin."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from airground.config import KeyframeSlam
from airground.core.messages import ImuSamples, RobotCalibration
from airground.core.se3 import SE3
from airground.slam import so3, starts
from airground.slam.frame import Frame
from airground.slam.inertial.preintegration import GRAVITY
from airground.slam.motion_model import MotionModel
from airground.slam.rig_state import RigState
from airground.slam.starts import (
    REST_WINDOW_NS,
    STANDING_M,
    MovingStart,
    RestStart,
    StandStill,
    TwoViewWait,
    level_start,
)
from tests.slam.inertial_motion import ADIS16448
from tests.slam.mapped_room import T_RIG_CAMERA, view
from tests.slam.synthetic_world import CAMERA

TILT = so3.exp(np.array([0.05, -0.08, 0.6]))
"""Of the IMU over the horizon, and some heading."""
CALIBRATION = RobotCalibration(
    CAMERA, T_RIG_CAMERA, SE3.from_rotation_vector((0.0, 0.02, 0.0), (0.1, 0.0, 0.05)), ADIS16448
)
WITHOUT_IMU = replace(CALIBRATION, imu=None)
GYRO_BIAS = np.array([0.01, -0.02, 0.005])
RATE_HZ = 200
IMAGE = np.zeros((240, 320), np.uint8)


def motion_of(force: np.ndarray, gyro: np.ndarray, clock_ns: int = 0) -> MotionModel:
    """A model that knows 3 s of (N, 3) samples or the same one over and over.

    They begin at 0 s of the camera's clock.
    """
    stamps = np.arange(3 * RATE_HZ) * (10**9 // RATE_HZ) + clock_ns
    shape = (len(stamps), 3)
    model = MotionModel(ADIS16448, clock_ns)
    model.add(
        ImuSamples(stamps, np.broadcast_to(gyro, shape).copy(), np.broadcast_to(force, shape))
    )
    return model


def assert_camera_in_origin(state: RigState) -> None:
    T_map_camera = state.pose() @ CALIBRATION.T_imu_camera
    np.testing.assert_allclose(T_map_camera.translation, np.zeros(3), atol=1e-12)
    assert T_map_camera.rotation[1, 0] == pytest.approx(0.0, abs=1e-12)  # its x axis along +x
    assert T_map_camera.rotation[0, 0] > 0.9


def up_of(state: RigState) -> np.ndarray:
    """The map's z axis in the rig."""
    return state.rotation[2]


@pytest.mark.parametrize("clock_ns", [0, 10**10])
def test_up_is_where_the_accelerometer_says(clock_ns: int) -> None:
    model = motion_of(TILT.T @ [0, 0, GRAVITY], np.zeros(3), clock_ns)
    state = level_start(model, CALIBRATION, 10**9)
    np.testing.assert_allclose(up_of(state), TILT[2], atol=1e-12)
    assert_camera_in_origin(state)
    np.testing.assert_array_equal(state.velocity, np.zeros(3))


def test_standing_still_tells_both_biases() -> None:
    stronger = 1.01 * GRAVITY
    model = motion_of(TILT.T @ [0, 0, stronger], GYRO_BIAS)
    standing = StandStill(CALIBRATION)
    stamps = range(10**9, 10**9 + REST_WINDOW_NS + 1, REST_WINDOW_NS // 5)
    found = [standing.observe(stamp, np.full(3, 0.1), model) for stamp in stamps]
    assert all(rest is None for rest in found[:-1])
    assert found[-1] is not None
    state = RigState.at_origin(TILT).standing(found[-1])
    np.testing.assert_allclose(state.gyro_bias, GYRO_BIAS, atol=1e-12)
    np.testing.assert_allclose(
        state.rotation @ state.accelerometer_bias, [0, 0, stronger - GRAVITY], atol=1e-9
    )


def test_who_moves_evenly_or_shakes_stands_not() -> None:
    even = motion_of(TILT.T @ [0, 0, GRAVITY], np.zeros(3))
    rng = np.random.default_rng(0)
    shaking = motion_of(TILT.T @ [0, 0, GRAVITY] + rng.normal(0, 0.5, (600, 3)), np.zeros(3))
    for model, step_m in ((even, 0.3 * STANDING_M), (shaking, 0.0)):
        standing = StandStill(CALIBRATION)
        for n in range(40):
            place = np.array([n * step_m, 0.0, 0.0])
            assert standing.observe(10**9 + n * REST_WINDOW_NS // 10, place, model) is None


@pytest.mark.parametrize("pushed", [[0, 0, 0.7], [0, 0, -1.0], [4.0, 0, 0]])
def test_pushed_or_without_an_accelerometer_the_body_stands_level(pushed: list[float]) -> None:
    level = CALIBRATION.T_body_imu.rotation[2]  # the body's z axis in the IMU
    model = motion_of(TILT.T @ np.add([0, 0, GRAVITY], pushed), np.zeros(3))
    early = motion_of(TILT.T @ [0, 0, GRAVITY], np.zeros(3))
    for state in (
        level_start(model, CALIBRATION, 10**9),
        level_start(early, CALIBRATION, -(10**9)),  # no sample yet
        level_start(MotionModel(None, 0), WITHOUT_IMU, 10**9),
    ):
        np.testing.assert_allclose(up_of(state), level, atol=1e-12)
        assert_camera_in_origin(state)


@pytest.mark.parametrize("pushed", [[0, 0, 0.7], [0, 0, -1.0], [0, 0, 4.0]])
def test_in_flight_up_is_where_the_accelerometer_says_however_hard_it_is_pushed(
    pushed: list[float],
) -> None:
    """What a recording states of its body does not change the map."""
    model = motion_of(TILT.T @ np.add([0, 0, GRAVITY], pushed), np.zeros(3))
    state = level_start(model, CALIBRATION, 10**9, flying=True)
    np.testing.assert_allclose(up_of(state), TILT[2], atol=1e-12)


def left_after(start: RestStart, model: MotionModel, until_s: float) -> int | None:
    """Feed images at 30 Hz from when the window is full; after which of them the rest ended."""
    for index in range(int(REST_WINDOW_NS * 3e-8), round(until_s * 30)):
        start.observe(Frame(round(index * 1e9 / 30), IMAGE), model)
        if start.rest is not None:
            return index
    return None


@pytest.mark.parametrize("clock_ns", [0, 10**10])
def test_a_robot_that_left_its_place_knows_what_its_imu_read_there(clock_ns: int) -> None:
    leaves_s = 1.5
    t = np.arange(3 * RATE_HZ) / RATE_HZ
    rng = np.random.default_rng(0)
    noise = ADIS16448.accelerometer_noise_density * np.sqrt(RATE_HZ)
    gyro_noise = ADIS16448.gyro_noise_density * np.sqrt(RATE_HZ)
    up = np.clip(t - leaves_s, 0, None)[:, None] * TILT[2]  # ever faster
    strength = GRAVITY * 1.003
    model = motion_of(
        strength * TILT[2] + 2.0 * up + rng.normal(0, noise, (len(t), 3)),
        GYRO_BIAS + rng.normal(0, gyro_noise, (len(t), 3)),
        clock_ns,
    )
    start = RestStart(CALIBRATION)
    index = left_after(start, model, 3.0)
    assert index is not None
    assert leaves_s < index / 30 < leaves_s + 0.25
    assert not start.resting
    assert start.rest is not None
    np.testing.assert_allclose(start.rest.gyro, GYRO_BIAS, atol=5e-4)
    # The slow beginning, hidden in the noise, is not part of it.
    np.testing.assert_allclose(start.rest.specific_force, strength * TILT[2], atol=0.01)


def test_at_rest_and_in_flight_it_waits() -> None:
    rest = motion_of(TILT.T @ [0, 0, GRAVITY], GYRO_BIAS)
    standing = RestStart(CALIBRATION)
    assert left_after(standing, rest, 3.0) is None
    assert standing.resting
    t = np.arange(3 * RATE_HZ)[:, None] / RATE_HZ
    sway = motion_of([0, 0, GRAVITY] + 0.3 * np.sin(6 * t), 0.05 * np.cos(5 * t) + GYRO_BIAS)
    assert left_after(RestStart(CALIBRATION), sway, 3.0) is None
    assert left_after(RestStart(WITHOUT_IMU), MotionModel(None, 0), 3.0) is None


PLACES = [(0.9 + 0.04 * n, 0.9 - 0.02 * n) for n in range(10)]


@cache
def two_view_start(with_imu: bool) -> tuple[int, MovingStart]:
    """The MAV passing over the room, level; which image ended the wait, and the start."""
    calibration = replace(
        CALIBRATION, imu=ADIS16448 if with_imu else None, T_body_imu=SE3.identity()
    )
    model = MotionModel(calibration.imu, 0)
    stamps = np.arange(-100, 400) * 5_000_000 + 10**9
    model.add(ImuSamples(stamps, np.zeros((500, 3)), np.broadcast_to([0.0, 0, GRAVITY], (500, 3))))
    wait = TwoViewWait(calibration, KeyframeSlam(), np.random.default_rng(0))
    for index, place in enumerate(PLACES):
        start = wait.observe(Frame(10**9 + index * 10**8, view(*place).image), model)
        if start is not None:
            return index, start
    raise AssertionError("no start")


@pytest.mark.parametrize("with_imu", [True, False])
def test_two_views_make_a_map_in_units_of_its_depth(with_imu: bool) -> None:
    index, start = two_view_start(with_imu)
    assert 1 <= index <= 6
    assert start.first.stamp_ns == 10**9
    assert start.second.stamp_ns == 10**9 + index * 10**8
    poses = [s.pose() @ T_RIG_CAMERA for s in (start.first_state, start.second_state)]
    truth = [view(*PLACES[n]).T_map_camera for n in (0, index)]
    depths = (poses[0].inverse() @ start.points_map)[:, 2]
    assert np.median(depths) == pytest.approx(1.0, abs=0.01)
    moved = poses[0].inverse() @ poses[1]
    true = truth[0].inverse() @ truth[1]
    turn = SE3(moved.rotation.T @ true.rotation, np.zeros(3))
    assert turn.angle() < np.deg2rad(1.0)
    unit = np.linalg.norm(true.translation) / np.linalg.norm(moved.translation)
    assert unit == pytest.approx(1.9, abs=0.15)  # the camera is 2 m over floor and boxes
    cosine = moved.translation @ true.translation * unit / (true.translation @ true.translation)
    assert cosine > np.cos(np.deg2rad(8.0))


@pytest.mark.parametrize("with_imu", [True, False])
def test_points_and_states_of_a_two_view_start_agree_and_stand_upright(with_imu: bool) -> None:
    _, start = two_view_start(with_imu)
    assert_camera_in_origin(start.first_state)
    np.testing.assert_allclose(up_of(start.first_state), [0, 0, 1], atol=1e-9)
    assert len(start.points_map) > 60
    for state, pixels in (
        (start.first_state, start.pixels_first),
        (start.second_state, start.pixels_second),
    ):
        points = (state.pose() @ T_RIG_CAMERA).inverse() @ start.points_map
        off = np.linalg.norm(CAMERA.project(points) - pixels, axis=1)
        assert off.max() < 3.0
        assert np.median(off) < 0.5


@pytest.mark.parametrize("with_imu", [True, False])
def test_images_between_the_two_views_get_their_poses(with_imu: bool) -> None:
    index, start = two_view_start(with_imu)
    assert [stamp_ns for stamp_ns, _ in start.views_before] == [
        10**9 + n * 10**8 for n in range(index)
    ]
    first, second = (s.pose() @ T_RIG_CAMERA for s in (start.first_state, start.second_state))
    way = second.translation - first.translation
    for stamp_ns, T_map_camera in start.views_before:
        # The camera moves evenly.
        share = (stamp_ns - 10**9) / (index * 10**8)
        off = T_map_camera.translation - first.translation - share * way
        assert np.linalg.norm(off) < 0.2 * np.linalg.norm(way)


def test_while_the_robot_rests_its_first_view_is_a_recent_one() -> None:
    wait = TwoViewWait(CALIBRATION, KeyframeSlam(), np.random.default_rng(0))
    model = motion_of(np.array([0, 0, GRAVITY]), np.zeros(3))
    stamps = [10**8 * (n + 1) for n in range(20)]
    for n, stamp_ns in enumerate(stamps[:10]):
        still = Frame(stamp_ns, view(*PLACES[0], seed=n).image)
        assert wait.observe(still, model, resting=True) is None
    starts_found = (
        wait.observe(Frame(stamp_ns, view(*place).image), model)
        for stamp_ns, place in zip(stamps[10:], PLACES[1:], strict=False)
    )
    start = next(found for found in starts_found if found is not None)
    assert start.first.stamp_ns >= stamps[9] - REST_WINDOW_NS
    known = [stamp_ns for stamp_ns, _ in start.views_before]
    # Those at rest have the first view's pose, back to the first image.
    assert known == [stamp_ns for stamp_ns in stamps if stamp_ns < start.second.stamp_ns]


def test_a_hovering_robot_waits_and_a_new_place_is_a_new_beginning() -> None:
    wait = TwoViewWait(CALIBRATION, KeyframeSlam(), np.random.default_rng(0))
    model = motion_of(np.array([0, 0, GRAVITY]), np.zeros(3))
    stamps = iter(range(10**8, 3 * 10**9, 10**8))
    for seed in range(4):
        assert wait.observe(Frame(next(stamps), view(0.9, 0.9, seed=seed).image), model) is None
    # Carried elsewhere in the dark: the first view there is the new first one.
    assert wait.observe(Frame(next(stamps), IMAGE), model) is None
    elsewhere = next(stamps)
    assert wait.observe(Frame(elsewhere, view(*PLACES[0]).image), model) is None
    start = None
    for place in PLACES[2::2]:
        start = start or wait.observe(Frame(next(stamps), view(*place).image), model)
    assert start is not None
    assert start.first.stamp_ns == elsewhere


def test_where_nothing_is_seen_corners_are_sought_less_often(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wait = TwoViewWait(CALIBRATION, KeyframeSlam(), np.random.default_rng(0))
    model = motion_of(np.array([0, 0, GRAVITY]), np.zeros(3))
    sought: list[int] = []
    detect = starts.detect_corners

    def watched(image: np.ndarray, *args: object) -> np.ndarray:
        sought.append(int(image.max()))
        return detect(image, *args)  # type: ignore[arg-type]

    monkeypatch.setattr(starts, "detect_corners", watched)
    for n in range(60):
        assert wait.observe(Frame((n + 1) * 10**8, IMAGE), model) is None
    assert 10 <= len(sought) <= 15
    # Once there is something to see, it is seen soon, and nothing is passed over any more.
    for n in range(60, 60 + starts.MOST_PASSED_OVER + 3):
        wait.observe(Frame((n + 1) * 10**8, view(0.9, 0.9, seed=n).image), model)
    assert sought[-1] > 0
    assert wait._first is not None
    assert len(wait._tracker.ids) > starts.MIN_CORNERS
