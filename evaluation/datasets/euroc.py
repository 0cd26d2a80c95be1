"""The MAV as an EuRoC/ASL folder (Burri et al., IJRR 2016); docs/datasets.md lists it.
The body of T_BS is the IMU. EuRoC itself has no magnetometer (`mag0/`)."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io import layout
from airground.io.euroc import sensor_yaml
from airground.io.input_files import SETTINGS_LIMIT, TEXT_LIMIT, read_bytes, read_text
from airground.io.ply import write_ply
from evaluation.datasets.simulated import Simulated, copy_images
from evaluation.datasets.views import sample_surface
from sim.robots.motion import RATE_HZ, Robot

YAML_START = "%YAML:1.0\n"
"""First line of EuRoC's files, which OpenCV's reader requires."""
STATE_COLUMNS = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
    "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], "
    "b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], "
    "b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]"
)
BIAS_WINDOW_S = 1.0
"""Standard deviation of the Gaussian that averages a sample's errors to its bias [s]."""
SURFACE_POINTS = 200_000
_PLAIN = re.compile(r"[\w ,]+")
"""Text that needs no quotes in YAML."""


def write_euroc_folder(folder: Path, simulated: Simulated, robots: tuple[Robot, ...]) -> None:
    """Fill an empty folder with `mav0/`."""
    assert robots == ("mav",)
    recording = simulated.recording
    copy_images(simulated.files.mav_files, folder / layout.MAV_IMAGES)
    for sensor in (layout.MAV_CAMERA, layout.MAV_IMU, layout.MAV_MAGNETOMETER):
        (folder / sensor).mkdir(exist_ok=True)
        samples = read_bytes(recording.path / sensor / "data.csv", TEXT_LIMIT)
        (folder / sensor / "data.csv").write_bytes(samples)
        yaml = read_text(recording.path / sensor / "sensor.yaml", SETTINGS_LIMIT)
        _write_yaml(folder / sensor / "sensor.yaml", yaml)
    header = recording.header
    comment = f"airground {header.scene}, seed {header.seed}, flight {header.flight}"
    if not _PLAIN.fullmatch(comment):
        comment = json.dumps(comment)
    _write_yaml(folder / "mav0" / "body.yaml", f"comment: {comment}\n")
    state = folder / "mav0" / "state_groundtruth_estimate0"
    state.mkdir()
    _write_yaml(state / "sensor.yaml", sensor_yaml("visual-inertial", SE3.identity(), {}))
    _write_states(state / "data.csv", simulated)
    surface = folder / "mav0" / "pointcloud0"
    surface.mkdir()
    _write_yaml(surface / "sensor.yaml", sensor_yaml("pointcloud", SE3.identity(), {}))
    write_ply(surface / "data.ply", sample_surface(simulated.truth.surface("mav"), SURFACE_POINTS))


def true_imu(simulated: Simulated, robot: Robot) -> tuple[Trajectory, NDArray[np.float64]]:
    """The IMU at 200 Hz, stamped by the robot's clock: `T_world_imu`, and its velocity in the world
    (N, 3) [m/s]."""
    motion = simulated.motion(robot)
    T_body_imu = motion.mounting.T_body_imu
    arm = T_body_imu.translation
    rotations = motion.rotations_world
    poses = Trajectory(
        simulated.motion_stamps_ns(robot),
        rotations @ T_body_imu.rotation,
        motion.positions_world + rotations @ arm,
    )
    swing = np.einsum("nij,nj->ni", rotations, np.cross(motion.angular_velocities_body, arm))
    return poses, motion.velocities_world + swing


def _write_states(path: Path, simulated: Simulated) -> None:
    poses, velocities = true_imu(simulated, "mav")
    quaternions_wxyz = np.roll(poses.quaternions_xyzw(), 1, axis=1)
    table = np.hstack([poses.translations, quaternions_wxyz, velocities, _biases(simulated)])
    lines = [
        f"{stamp}," + ",".join(f"{value:.9f}" for value in row)
        for stamp, row in zip(poses.stamps_ns.tolist(), table.tolist(), strict=True)
    ]
    path.write_text("\n".join([STATE_COLUMNS, *lines]) + "\n", encoding="utf-8")


def _biases(simulated: Simulated) -> NDArray[np.float64]:
    """(N, 6) biases of gyro [rad/s] and accelerometer [m/s^2] from the truth: recordings hold none.
    White noise remains with its density over sqrt(2 sqrt(pi) BIAS_WINDOW_S). Where samples are
    missing, biases are interpolated."""
    samples, _ = simulated.samples("mav")
    motion, motion_ns = simulated.motion("mav"), simulated.truth.motion.stamps_ns
    times_ns = simulated.imu_times_ns("mav")
    measured = np.hstack([samples.gyro, samples.accelerometer])
    true = np.hstack([motion.gyro_imu, motion.specific_force_imu])
    errors = measured - true[np.searchsorted(motion_ns, times_ns)]
    smooth = gaussian_filter1d(errors, BIAS_WINDOW_S * RATE_HZ, axis=0, mode="nearest")
    return np.column_stack([np.interp(motion_ns, times_ns, bias) for bias in smooth.T])


def _write_yaml(path: Path, text: str) -> None:
    path.write_text(YAML_START + text, encoding="utf-8")
