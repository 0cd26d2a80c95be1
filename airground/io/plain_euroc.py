"""Plain EuRoC/ASL folders, as ETH Zurich and others publish them.

    mav0/cam0/{sensor.yaml,data.csv,data/*.png}    one grey camera
    mav0/imu0/{sensor.yaml,data.csv}               may be missing
    mav0/mag0/data.csv                             may be missing

The body of `T_BS` is in general not level: gravity defines a body whose z axis points up."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airground.core.arrays import F64, I64
from airground.core.cloud import Source
from airground.core.messages import ImuNoise, ImuSamples, MavImage, RobotCalibration
from airground.core.se3 import SE3
from airground.errors import RecordingError
from airground.io.euroc import read_image_list, read_imu, read_magnetic
from airground.io.folder_links import check_links
from airground.io.image_files import listed_files
from airground.io.images import read_grey
from airground.io.lens import Undistortion
from airground.io.plausibility import (
    CAMERA_STEP_S,
    IMU_STEP_S,
    check_imu_covers,
    check_stamp_unit,
    check_up_in_camera,
    level_body,
    upwards,
)
from airground.io.robot_recording import RobotRecording
from airground.io.sensor_file import read_imu_noise, read_lens, read_pose

UP_LEVEL_CAMERA = np.array([0.0, -1.0, 0.0])
"""Up in a camera that looks straight ahead; assumed where no sensor measures it."""


def euroc_folder(path: Path) -> Path | None:
    """`mav0` in or at `path`; None where this is no EuRoC folder."""
    return next((folder for folder in (path / "mav0", path) if (folder / "cam0").is_dir()), None)


def open_euroc(path: Path, calibration_file: Path | None = None) -> RobotRecording[MavImage]:
    """Open a folder of one grey camera and perhaps an IMU, and check all but its images.

    Args:
        path: The folder `mav0`, or the one that holds it.
        calibration_file: Camera calibration to use in place of `cam0/sensor.yaml`.

    Raises:
        RecordingError: One line that names file, key or stamp and what would be right.
    """
    folder = euroc_folder(path)
    if folder is None:
        raise RecordingError(f"{path}: has no mav0/cam0; is this an EuRoC folder?")
    check_links(path)
    camera, camera_list = folder / "cam0", folder / "cam0" / "data.csv"
    sensor_file = calibration_file or camera / "sensor.yaml"
    lens = read_lens(sensor_file)
    undistortion = Undistortion(lens)
    stamps, names = read_image_list(camera_list)
    check_stamp_unit(stamps, camera_list, "nanoseconds", CAMERA_STEP_S)
    files = listed_files(camera / "data", names, camera_list)
    missing = next((file for file in files if not file.is_file()), None)
    if missing is not None:
        raise RecordingError(f"{missing}: this image is listed in {camera_list.name} but missing")
    T_body_camera = read_pose(camera / "sensor.yaml")
    inertial = None
    if (folder / "imu0").exists():
        inertial = read_inertial(folder / "imu0", T_body_camera, stamps)
    T_imu_camera = inertial.T_imu_camera if inertial else SE3.identity()
    up_imu = inertial.up_imu if inertial else UP_LEVEL_CAMERA
    magnetic_file = folder / "mag0" / "data.csv"

    def read_image(index: int) -> MavImage:
        grey = read_grey(files[index], lens.width, lens.height)
        return MavImage(int(stamps[index]), undistortion.image(grey))

    read_image(0)
    return RobotRecording(
        path=path,
        layout="euroc",
        robot=Source.MAV,
        calibration=RobotCalibration(
            undistortion.camera,
            T_imu_camera,
            level_body(up_imu, T_imu_camera),
            inertial.noise if inertial else None,
            readout_s=undistortion.readout_s,
        ),
        camera_stamps=stamps,
        imu=inertial.samples if inertial else None,
        magnetic=read_magnetic(magnetic_file) if magnetic_file.exists() else None,
        read_image=read_image,
        pose_frame="body",
        T_pose_camera=T_body_camera,
    )


@dataclass(frozen=True, eq=False)
class Inertial:
    """An IMU beside a camera.

    Attributes:
        samples, noise: All samples, and noise densities from `sensor.yaml`.
        T_imu_camera: Pose of the camera in the IMU's frame.
        up_imu: (3,) unit vector against gravity in the IMU's frame at the first samples.
    """

    samples: ImuSamples
    noise: ImuNoise
    T_imu_camera: SE3
    up_imu: F64


def read_inertial(folder: Path, T_body_camera: SE3, camera_stamps_ns: I64) -> Inertial:
    """Read the folder `imu0`, and check that it fits the images; raises like `open_euroc`.
    `T_body_camera` is the camera's pose in the body of `T_BS`, `camera_stamps_ns` (N,)."""
    imu_file, sensor_file = folder / "data.csv", folder / "sensor.yaml"
    T_imu_camera = _in_imu(read_pose(sensor_file), T_body_camera)
    samples = read_imu(imu_file)
    check_stamp_unit(samples.stamps_ns, imu_file, "nanoseconds", IMU_STEP_S)
    check_imu_covers(samples, imu_file, camera_stamps_ns)
    up_imu = upwards(samples, imu_file)
    check_up_in_camera(T_imu_camera.rotation.T @ up_imu, imu_file)
    return Inertial(samples, read_imu_noise(sensor_file), T_imu_camera, up_imu)


def _in_imu(T_body_imu: SE3, T_body_camera: SE3) -> SE3:
    """Pose of the camera in the IMU's frame; unchanged to the last bit if the body is the IMU."""
    if (T_body_imu.matrix() == np.eye(4)).all():
        return T_body_camera
    return T_body_imu.inverse() @ T_body_camera
