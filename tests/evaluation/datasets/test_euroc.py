"""The EuRoC export has the official files, and its states fit its samples."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest
from evo.core import metrics
from evo.tools import file_interface
from scipy.spatial.transform import Rotation

from airground.io.euroc import read_imu
from airground.io.sensor_file import read_mapping
from evaluation.datasets.formats import FORMATS
from evaluation.datasets.simulated import Simulated
from evaluation.table.true_camera import read_euroc_poses
from sim.recording import recorder
from sim.recording.recorder import record
from sim.scene import parse_scene
from sim.sensors.presets import NOMINAL
from sim.sensors.turned import with_fault
from tests.evaluation.conftest import images_in_flight
from tests.sim.small_flight import SCENE

OFFICIAL = {
    "body.yaml",
    "cam0/data.csv",
    "cam0/sensor.yaml",
    "imu0/data.csv",
    "imu0/sensor.yaml",
    "pointcloud0/data.ply",
    "pointcloud0/sensor.yaml",
    "state_groundtruth_estimate0/data.csv",
    "state_groundtruth_estimate0/sensor.yaml",
}
"""Of a Vicon room, without its second camera and without the motion capture's own poses."""
ADDED = {"mag0/data.csv", "mag0/sensor.yaml"}
OFFICIAL_COLUMNS = {
    "cam0": "#timestamp [ns],filename",
    "imu0": "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]",
    "state_groundtruth_estimate0": "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], "
    "q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], "
    "v_RS_R_z [m s^-1], b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
    "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]",
}
_SENSOR = "sensor_type comment T_BS"
OFFICIAL_KEYS = {
    "cam0": f"{_SENSOR} rate_hz resolution camera_model intrinsics distortion_model "
    "distortion_coefficients",
    "imu0": f"{_SENSOR} rate_hz gyroscope_noise_density gyroscope_random_walk "
    "accelerometer_noise_density accelerometer_random_walk",
    "state_groundtruth_estimate0": _SENSOR,
}
ADDED_KEYS = {"imu0": ["accelerometer_bias_sigma"]}
GRAVITY = np.array([0.0, 0.0, -9.81])


@pytest.fixture(scope="module")
def mav0(exported: Callable[[str], Path]) -> Path:
    return exported("euroc") / "mav0"


@pytest.fixture(scope="module")
def states(mav0: Path) -> np.ndarray:
    return np.loadtxt(mav0 / "state_groundtruth_estimate0" / "data.csv", delimiter=",")


def test_the_files_are_the_official_ones(mav0: Path) -> None:
    files = {str(path.relative_to(mav0)) for path in mav0.rglob("*") if path.is_file()}
    images = {name for name in files if name.startswith("cam0/data/")}
    assert files - images == OFFICIAL | ADDED
    lines = (mav0 / "cam0/data.csv").read_text().splitlines()[1:]
    assert [line.split(",")[0] + ".png" for line in lines] == [n.split(",")[1] for n in lines]
    assert images == {f"cam0/data/{line.split(',')[1]}" for line in lines}


@pytest.mark.parametrize("sensor", OFFICIAL_COLUMNS)
def test_their_columns_and_keys_are_the_official_ones(mav0: Path, sensor: str) -> None:
    assert (mav0 / sensor / "data.csv").read_text().splitlines()[0] == OFFICIAL_COLUMNS[sensor]
    text = (mav0 / sensor / "sensor.yaml").read_text()
    assert text.startswith("%YAML:1.0\n")
    keys = OFFICIAL_KEYS[sensor].split() + ADDED_KEYS.get(sensor, [])
    assert list(read_mapping(mav0 / sensor / "sensor.yaml")) == keys


def test_evo_finds_no_error_of_the_truth_against_itself(mav0: Path, simulated: Simulated) -> None:
    path = mav0 / "state_groundtruth_estimate0" / "data.csv"
    truth = file_interface.read_euroc_csv_trajectory(str(path))
    error = metrics.APE(metrics.PoseRelation.full_transformation)
    error.process_data((truth, truth))
    assert truth.num_poses == len(simulated.truth.motion.stamps_ns)
    assert error.get_statistic(metrics.StatisticsType.max) == pytest.approx(0.0, abs=1e-9)


def test_the_state_is_that_of_the_imu(mav0: Path, simulated: Simulated) -> None:
    poses = read_euroc_poses(mav0 / "state_groundtruth_estimate0" / "data.csv")
    motion = simulated.truth.motion
    for index in range(0, len(poses), 97):
        true = motion.pose("mav", int(poses.stamps_ns[index])) @ motion.mav.mounting.T_body_imu
        assert np.abs((true.inverse() @ poses[index]).log()).max() < 1e-7


def test_velocity_is_the_change_of_position(states: np.ndarray) -> None:
    position, velocity = states[:, 1:4], states[:, 8:11]
    moved = (position[2:] - position[:-2]) / 0.01
    assert np.abs(velocity).max() > 0.2
    assert np.abs(moved - velocity[1:-1]).max() < 5e-3


def test_samples_without_their_biases_carry_the_state_onwards(
    mav0: Path, states: np.ndarray
) -> None:
    """Strapdown integration over half a second in flight, with the columns' own meaning."""
    imu = read_imu(mav0 / "imu0" / "data.csv")
    start, steps, dt = 600, 100, 0.005
    np.testing.assert_array_equal(imu.stamps_ns, states[:, 0].astype(np.int64))
    rotation = Rotation.from_quat(states[start, [5, 6, 7, 4]])
    position, velocity = states[start, 1:4], states[start, 8:11]
    for index in range(start, start + steps):
        gyro = imu.gyro[index : index + 2].mean(0) - states[index, 11:14]
        force = imu.accelerometer[index : index + 2].mean(0) - states[index, 14:17]
        half = rotation * Rotation.from_rotvec(gyro * dt / 2)
        acceleration = half.apply(force) + GRAVITY
        position = position + velocity * dt + acceleration * dt**2 / 2
        velocity = velocity + acceleration * dt
        rotation = rotation * Rotation.from_rotvec(gyro * dt)
    end = states[start + steps]
    turn = rotation.inv() * Rotation.from_quat(end[[5, 6, 7, 4]])
    assert np.linalg.norm(end[1:4] - states[start, 1:4]) > 0.05
    assert np.linalg.norm(position - end[1:4]) < 2e-3
    assert np.rad2deg(turn.magnitude()) < 0.05


def test_the_surface_is_the_true_one(mav0: Path, simulated: Simulated) -> None:
    cloud = o3d.io.read_point_cloud(str(mav0 / "pointcloud0" / "data.ply"))
    distances = simulated.truth.surface("mav").distance(np.asarray(cloud.points))
    assert len(distances) == 200_000
    assert distances.max() < 1e-5


def test_an_imu_that_was_silent_leaves_the_truth_whole(
    simulated: Simulated, states: np.ndarray, tmp_path: Path
) -> None:
    """The same flight with 0.3 s without samples: states at all times, biases as beside the gap."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", images_in_flight)
        scene = parse_scene(SCENE, "small.toml")
        path = record(scene, 3, with_fault(NOMINAL, "imu_gap", 0.3), tmp_path / "silent", workers=1)
    silent = Simulated.open(path)
    samples, _ = silent.samples("mav")
    assert len(simulated.truth.motion.stamps_ns) - len(samples.stamps_ns) == 60
    FORMATS["euroc"].write(tmp_path / "euroc", silent, ("mav",))
    folder = tmp_path / "euroc" / "mav0"
    written = np.loadtxt(folder / "state_groundtruth_estimate0" / "data.csv", delimiter=",")
    np.testing.assert_array_equal(written[:, :11], states[:, :11])
    assert np.abs(written[:, 11:] - states[:, 11:]).max() < 0.1
    assert len(read_imu(folder / "imu0" / "data.csv").stamps_ns) == len(samples.stamps_ns)
