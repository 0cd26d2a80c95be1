import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airground.errors import InputError
from sim.robots.flight import fly, plan_flight
from sim.robots.quadrotor import INERTIA, MASS_KG, MOUNTING, quadrotor_model
from sim.robots.robot_motion import ideal_imu
from sim.world.magnetic_field import room_field
from tests.sim.flights import MAV, STEP_S, small_scene
from tests.sim.strapdown import imu_state, integrate_imu

FLOOR = 0.3
TIMES = np.arange(0, 18 + STEP_S / 2, STEP_S)


@pytest.fixture(scope="module")
def plan():
    return plan_flight(small_scene().mav, FLOOR, TIMES, np.random.default_rng(5))


@pytest.fixture(scope="module")
def flight(plan):
    field = room_field(np.random.default_rng(0), [-3, -3], [3, 3], FLOOR)
    return fly(plan, STEP_S, field)


def test_model_has_the_stated_mass_and_its_centre_at_the_origin():
    model = quadrotor_model(-2.0, 1.0, 0.5, 0.3)
    mav = model.body("mav")
    assert mav.mass == pytest.approx(MASS_KG)
    np.testing.assert_allclose(mav.inertia, INERTIA)
    np.testing.assert_allclose(mav.ipos, 0)


def test_rotors_make_the_torques_of_their_places():
    model = quadrotor_model(0.0, 0.0, -10.0, 0.0)
    data = mujoco.MjData(model)
    data.act[:] = [1.0, 2.0, 3.0, 4.0]
    mujoco.mj_forward(model, data)
    # Front right, front left, back left, back right; 0.12 m arms.
    roll = 0.12 * (-1.0 + 2.0 + 3.0 - 4.0)
    pitch = 0.12 * (-1.0 - 2.0 + 3.0 + 4.0)
    yaw = 0.016 * (-1.0 + 2.0 - 3.0 + 4.0)
    np.testing.assert_allclose(data.qfrc_actuator, [0, 0, 10, roll, pitch, yaw], atol=1e-12)


def test_it_stands_still_until_takeoff_and_has_risen_three_seconds_later(flight):
    height = flight.positions_world[:, 2] - FLOOR
    takeoff_s = small_scene().mav.takeoff_s
    standing = takeoff_s > TIMES
    assert np.ptp(height[standing]) < 1e-3
    assert np.abs(flight.velocities_world[standing]).max() < 5e-3
    np.testing.assert_allclose(flight.specific_force_imu[0], [0, 0, 9.81], atol=2e-3)
    assert height[np.searchsorted(TIMES, takeoff_s + 3)] == pytest.approx(2.2, abs=0.12)


def test_it_tracks_its_plan_with_little_tilt(flight, plan):
    error = np.linalg.norm(flight.positions_world - plan.position[0], axis=1)
    assert np.sqrt(np.mean(error**2)) < 0.03
    assert error.max() < 0.08
    tilt = np.arccos(np.clip(flight.rotations_world[:, 2, 2], -1, 1))
    assert np.rad2deg(tilt.max()) < 10
    heading = np.arctan2(flight.rotations_world[:, 1, 0], flight.rotations_world[:, 0, 0])
    assert np.abs(np.rad2deg(heading - plan.heading[0, :, 0])).max() < 1.0


def test_it_hovers_at_the_last_waypoint_in_the_end(flight):
    assert np.linalg.norm(flight.positions_world[-1, :2] - MAV["waypoints"][-1]) < 0.25
    assert np.linalg.norm(flight.velocities_world[-400:], axis=1).max() < 0.35


def test_the_camera_looks_down_with_forward_up():
    rotation = MOUNTING.T_body_camera.rotation
    np.testing.assert_allclose(rotation @ [0, 0, 1], [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(rotation @ [0, -1, 0], [1, 0, 0], atol=1e-12)


@pytest.mark.parametrize("start_s", [0.5, 5.0])
def test_the_imu_integrates_to_the_path_over_ten_seconds(flight, start_s):
    first, count = round(start_s / STEP_S), 2000
    positions, rotations = integrate_imu(flight, first, count, STEP_S)
    rotation, position, _ = imu_state(flight, first + count)
    assert np.linalg.norm(positions[-1] - position) < 1.5e-3
    assert Rotation.from_matrix(rotation.T @ rotations[-1]).magnitude() < np.deg2rad(1e-3)


def test_mujocos_imu_equals_rigid_body_kinematics():
    """Gyro and accelerometer of a tumbling MAV against the closed form, lever arm included."""
    rng = np.random.default_rng(3)
    model = quadrotor_model(0.0, 0.0, -10.0, 0.0)
    data = mujoco.MjData(model)
    for _ in range(5):
        data.qpos[3:] = Rotation.random(rng=rng).as_quat()[[3, 0, 1, 2]]
        data.qvel[:] = rng.standard_normal(6)
        data.act[:] = rng.uniform(0, 5, 4)
        mujoco.mj_forward(model, data)
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[3:])
        gyro, force = ideal_imu(
            rotation.reshape(1, 3, 3),
            data.qacc[None, :3],
            data.qvel[None, 3:],
            data.qacc[None, 3:],
            MOUNTING.T_body_imu,
        )
        np.testing.assert_allclose(gyro[0], data.sensor("gyro").data, atol=1e-10)
        np.testing.assert_allclose(force[0], data.sensor("accelerometer").data, atol=1e-8)


def test_a_time_too_short_to_take_off_is_refused():
    with pytest.raises(InputError, match=r"duration_s = 3.5 is too short.*at least 4"):
        plan_flight(small_scene().mav, 0.0, np.array([0.0, 3.5]), np.random.default_rng(0))
