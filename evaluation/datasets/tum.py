"""The ground robot as a TUM RGB-D folder (Sturm et al., IROS 2012); docs/datasets.md lists it.
TUM's own folders have no calibration, gyro and magnetometer."""

from __future__ import annotations

import shutil
from pathlib import Path

from airground.core.messages import ImuSamples
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.io import layout
from airground.io.euroc import camera_yaml
from airground.io.plain_tum import ACCELEROMETER_AXES, DEPTH_UNITS_PER_M
from airground.io.tum import write_accelerometer, write_tum
from evaluation.datasets.simulated import Simulated, copy_images
from sim.robots.motion import Robot

SAME_FILES = (
    layout.GROUND_COLOUR_LIST,
    layout.GROUND_DEPTH_LIST,
    layout.GROUND_ASSOCIATIONS,
    layout.GROUND_IMU_DATA,
    f"{layout.GROUND_IMU}/sensor.yaml",
    layout.GROUND_MAGNETOMETER_DATA,
    f"{layout.GROUND_MAGNETOMETER}/sensor.yaml",
)
"""Files that a recording has in TUM's and EuRoC's form already."""


def write_tum_folder(folder: Path, simulated: Simulated, robots: tuple[Robot, ...]) -> None:
    """Fill an empty folder with the ground robot's data.

    Raises:
        InputError: The depth images have another unit than TUM's.
    """
    assert robots == ("ground",)
    recording = simulated.recording
    units_per_m = recording.header.calibration.ground.depth.units_per_m
    if units_per_m != DEPTH_UNITS_PER_M:
        raise InputError(
            f"{recording.path}: a metre of depth is {units_per_m:g} in its PNG "
            f"files; TUM's format prescribes {DEPTH_UNITS_PER_M:g}"
        )
    copy_images(simulated.files.ground_colour_files, folder / "rgb")
    (folder / "depth").mkdir()
    for index, file in enumerate(simulated.files.ground_depth_files):
        (folder / "depth" / file.name).write_bytes(simulated.files.depth_png(index))
    for name in SAME_FILES:
        target = folder / Path(name).relative_to("ground")
        target.parent.mkdir(exist_ok=True)
        shutil.copyfile(recording.path / name, target)
    write_accelerometer(folder / "accelerometer.txt", _of_a_kinect(simulated))
    T_imu_camera = simulated.T_imu_camera("ground")
    yaml = camera_yaml(simulated.nominal("ground").camera, T_imu_camera)
    (folder / "calibration.yaml").write_text(yaml, encoding="utf-8")
    stamps_ns = simulated.stamps_ns("ground")
    poses = [simulated.truth.T_world_camera("ground", stamp_ns) for stamp_ns in stamps_ns]
    write_tum(folder / "groundtruth.txt", Trajectory.from_poses(stamps_ns, poses))


def _of_a_kinect(simulated: Simulated) -> ImuSamples:
    """The accelerometer's samples in a Kinect's axes."""
    samples, _ = simulated.samples("ground")
    in_camera = samples.accelerometer @ simulated.T_imu_camera("ground").rotation
    return ImuSamples(samples.stamps_ns, samples.gyro, in_camera * ACCELEROMETER_AXES)
