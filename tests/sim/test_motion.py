import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airground.errors import InputError
from sim.robots.ground_robot import drive, mounting, plan_drive
from sim.robots.motion import ROBOTS, STEP_NS, Motion
from sim.world.magnetic_field import EARTH_FIELD_WORLD, MagneticField, room_field
from tests.sim.flights import STEP_S, Floor, simulate, small_scene
from tests.sim.strapdown import imu_state, integrate_imu

NO_IRON = MagneticField(np.zeros((0, 3)), np.zeros((0, 3)))


@pytest.fixture(scope="module")
def motion():
    return simulate(small_scene())


def test_stamps_are_200_hz_to_the_end(motion):
    assert motion.stamps_ns[1] == 5_000_000
    assert motion.stamps_ns[-1] == 14_000_000_000
    assert motion.duration_s == 14.0


def test_the_same_seed_gives_the_same_bytes(motion, tmp_path):
    again = simulate(small_scene())
    motion.save(tmp_path / "a.npz")
    again.save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_another_seed_is_another_flight(motion):
    other = simulate(small_scene(), seed=1, duration_s=8.0)
    for robot in ROBOTS:
        shift = motion.robot(robot).positions_world[1600] - other.robot(robot).positions_world[-1]
        assert 1e-3 < np.linalg.norm(shift) < 0.5


def test_a_shorter_motion_is_the_beginning_of_a_longer_one(motion):
    shorter = simulate(small_scene(), duration_s=5.0)
    count = len(shorter.stamps_ns)
    for robot in ROBOTS:
        np.testing.assert_array_equal(
            shorter.robot(robot).specific_force_imu,
            motion.robot(robot).specific_force_imu[:count],
        )


def test_save_and_load_are_inverse(motion, tmp_path):
    motion.save(tmp_path / "motion.npz")
    loaded = Motion.load(tmp_path / "motion.npz")
    np.testing.assert_array_equal(loaded.stamps_ns, motion.stamps_ns)
    for robot in ROBOTS:
        ours, theirs = motion.robot(robot), loaded.robot(robot)
        np.testing.assert_array_equal(ours.gyro_imu, theirs.gyro_imu)
        np.testing.assert_array_equal(ours.rotations_world, theirs.rotations_world)
        np.testing.assert_allclose(
            ours.mounting.T_body_camera.matrix(), theirs.mounting.T_body_camera.matrix()
        )


def test_a_damaged_or_missing_file_is_named(motion, tmp_path):
    path = tmp_path / "motion.npz"
    with pytest.raises(InputError, match=r"motion\.npz: not a readable motion"):
        Motion.load(path)
    motion.save(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"motion\.npz: not a readable motion"):
        Motion.load(path)
    np.savez(path, format=np.array(1), stamps_ns=motion.stamps_ns)
    with pytest.raises(InputError, match="mav_positions_world"):
        Motion.load(path)


@pytest.mark.parametrize("robot", ROBOTS)
def test_interpolated_poses_meet_what_was_left_out(motion, robot):
    """Poses between every other sample against the samples in between."""
    truth = motion.robot(robot)
    for index in range(401, 2400, 53):
        pose = truth.pose(index, 0.5, STEP_S)  # between index and index + 1
        halved = type(truth)(
            **{
                name: getattr(truth, name)[index - 1 : index + 2 : 2]
                for name in vars(truth)
                if name != "mounting"
            },
            mounting=truth.mounting,
        )
        middle = halved.pose(0, 0.5, 2 * STEP_S)
        np.testing.assert_allclose(middle.translation, truth.positions_world[index], atol=2e-6)
        turn = middle.rotation.T @ truth.rotations_world[index]
        assert Rotation.from_matrix(turn).magnitude() < 2e-6
        mean = (truth.positions_world[index] + truth.positions_world[index + 1]) / 2
        np.testing.assert_allclose(pose.translation, mean, atol=1e-4)


def test_pose_at_a_stamp_is_the_state_and_the_camera_rides_on_it(motion):
    stamp = 1000 * STEP_NS
    pose = motion.pose("mav", stamp)
    np.testing.assert_array_equal(pose.translation, motion.mav.positions_world[1000])
    camera = motion.camera_pose("mav", stamp)
    np.testing.assert_allclose(
        camera.translation, pose @ motion.mav.mounting.T_body_camera.translation
    )
    assert camera.rotation[2, 2] < -0.98  # looks down
    last = int(motion.stamps_ns[-1])
    np.testing.assert_array_equal(
        motion.pose("ground", last).translation, motion.ground.positions_world[-1]
    )


@pytest.mark.parametrize("stamp", [-1, 14_000_000_001])
def test_a_time_outside_is_refused(motion, stamp):
    with pytest.raises(ValueError, match="outside the motion"):
        motion.pose("mav", stamp)


def test_velocities_are_derivatives_of_the_poses(motion):
    """The drive is exact; the flight is held to what RK4 made of smooth forces."""
    for robot, tolerance in (("mav", 2e-4), ("ground", 2e-4)):
        truth = motion.robot(robot)
        middle = (truth.positions_world[2:] - truth.positions_world[:-2]) / (2 * STEP_S)
        np.testing.assert_allclose(truth.velocities_world[1:-1], middle, atol=tolerance)


@pytest.mark.parametrize("start_s", [0.0, 3.0])
def test_the_ground_imu_integrates_to_the_path_over_ten_seconds(motion, start_s):
    first, count = round(start_s / STEP_S), 2000
    positions, rotations = integrate_imu(motion.ground, first, count, STEP_S)
    rotation, position, _ = imu_state(motion.ground, first + count)
    assert np.linalg.norm(positions[-1] - position) < 0.5e-3
    assert Rotation.from_matrix(rotation.T @ rotations[-1]).magnitude() < np.deg2rad(1e-3)


def test_the_ground_imu_equals_mujocos_inverse_dynamics():
    """A free body made to move as the base does, its sensors read by MuJoCo."""
    scene = small_scene()
    plan = plan_drive(scene.ground, Floor(0.05).floor_height, np.random.default_rng(2))
    times = np.linspace(1.5, 12, 23)
    sensors = mounting(scene.ground)
    truth = drive(plan, times, sensors, NO_IRON)
    x, y, z, w = sensors.T_body_imu.quaternion_xyzw()
    place = " ".join(map(str, sensors.T_body_imu.translation))
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><body><freejoint/><inertial pos="0 0 0" mass="1"
        diaginertia="1 1 1"/><site name="imu" pos="{place}" quat="{w} {x} {y} {z}"/></body>
        </worldbody><sensor><gyro site="imu"/><accelerometer site="imu"/></sensor></mujoco>"""
    )
    data = mujoco.MjData(model)
    h = 1e-4
    before, after = (drive(plan, times + shift, sensors, NO_IRON) for shift in (-h, h))
    alpha = (after.angular_velocities_body - before.angular_velocities_body) / (2 * h)
    position = plan.jets(times)[0]
    for index in range(len(times)):
        quaternion = Rotation.from_matrix(truth.rotations_world[index]).as_quat()
        data.qpos[:] = [*position[0, index], *quaternion[[3, 0, 1, 2]]]
        data.qvel[:] = [*position[1, index], *truth.angular_velocities_body[index]]
        data.qacc[:] = [*position[2, index], *alpha[index]]
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(data.sensordata[:3], truth.gyro_imu[index], atol=1e-12)
        np.testing.assert_allclose(data.sensordata[3:], truth.specific_force_imu[index], atol=1e-5)


def test_angular_velocity_is_the_derivative_of_the_rotation():
    plan = plan_drive(small_scene().ground, Floor(0.05).floor_height, np.random.default_rng(2))
    h, times = 1e-5, np.linspace(1.5, 12, 50)
    sensors = mounting(small_scene().ground)
    before, here, after = (drive(plan, times + s, sensors, NO_IRON) for s in (-h, 0.0, h))
    turn = np.swapaxes(before.rotations_world, 1, 2) @ after.rotations_world
    rate = Rotation.from_matrix(turn).as_rotvec() / (2 * h)
    np.testing.assert_allclose(here.angular_velocities_body, rate, atol=1e-6)


def test_the_base_stands_on_the_floor_and_rattles_a_little(motion):
    flat = simulate(small_scene(), duration_s=10.0, wave_m=0.0).ground
    moving = np.linalg.norm(flat.velocities_world, axis=1) > 0.3
    assert 0.5e-3 < flat.positions_world[moving, 2].std() < 4e-3
    tilt = np.rad2deg(np.arccos(np.clip(flat.rotations_world[:, 2, 2], -1, 1)))
    assert 0.05 < tilt[moving].mean() < 0.6
    place = motion.ground.positions_world
    floor = Floor(0.03).floor_height(place[:, 0], place[:, 1])
    assert np.abs(place[:, 2] - floor).max() < 0.012
    assert np.abs(motion.ground.velocities_world[:200]).max() < 1e-12


def test_the_ground_camera_looks_forward_and_down():
    scene = small_scene(ground={"camera_pitch_deg": 30.0, "camera_height_m": 0.5})
    camera = mounting(scene.ground).T_body_camera
    np.testing.assert_allclose(camera.rotation @ [0, 0, 1], [np.sqrt(0.75), 0, -0.5], atol=1e-12)
    np.testing.assert_allclose(camera.rotation @ [1, 0, 0], [0, -1, 0], atol=1e-12)
    assert camera.translation[2] == pytest.approx(0.5)


def test_iron_bends_the_field_as_maxwell_allows():
    field = room_field(np.random.default_rng(4), [-3, -3], [3, 3], 0.2)
    points = np.random.default_rng(0).uniform([-3, -3, 0.3], [3, 3, 3], (30, 3))
    h = 1e-4
    slopes = np.stack(
        [(field.at(points + e) - field.at(points - e)) / (2 * h) for e in h * np.eye(3)], axis=1
    )
    np.testing.assert_allclose(np.trace(slopes, axis1=1, axis2=2), 0, atol=1e-12)
    np.testing.assert_allclose(slopes, np.swapaxes(slopes, 1, 2), atol=1e-12)
    bend = np.arctan2(*field.at(points).T[1::-1])
    assert 0.1 < np.rad2deg(np.abs(bend)).mean() < 4.0


def test_the_magnetometer_reads_the_field_in_its_own_axes(motion):
    for robot in ROBOTS:
        truth = motion.robot(robot)
        imu = truth.rotations_world @ truth.mounting.T_body_imu.rotation
        earth = np.einsum("nij,nj->ni", imu, truth.field_imu - truth.anomaly_imu)
        np.testing.assert_allclose(earth, np.tile(EARTH_FIELD_WORLD, (len(truth), 1)), atol=1e-12)


@pytest.mark.parametrize("duration", [0.0, -1.0, np.nan, np.inf])
def test_an_impossible_duration_is_refused(duration):
    with pytest.raises(InputError, match="duration_s must be positive"):
        simulate(small_scene(), duration_s=duration)


def test_a_path_over_the_edge_of_the_floor_is_refused():
    scene = small_scene(ground={"waypoints": [(0.0, 0.0, 0.0), (2.95, 0.0, 0.0)]})
    with pytest.raises(InputError, match="leaves the floor at x = 3"):
        simulate(scene)
