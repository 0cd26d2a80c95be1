"""The IMU of a bag: its samples, its noise and where the camera sits in it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airground.core.arrays import F64, I64, Mask
from airground.core.messages import ImuNoise, ImuSamples
from airground.core.se3 import SE3
from airground.errors import RecordingError
from airground.io.plain_euroc import UP_LEVEL_CAMERA
from airground.io.plausibility import IMU_SLACK_S, check_up_in_camera, upwards
from airground.io.ros.bag import Bag
from airground.io.ros.samples import ADIS16448, mounting, read_imu
from airground.io.ros.topics import Chosen
from airground.io.sensor_file import NOISE_KEYS, POSE, read_imu_noise, read_mapping, read_pose


@dataclass(frozen=True, eq=False)
class BagImu:
    """What an IMU says of a camera.

    Attributes:
        samples, noise: All samples, and the noise densities; None without a gyro.
        T_imu_camera: Pose of the camera in the IMU's frame.
        up_imu: (3,) unit vector against gravity in the IMU's frame at the start.
        assumed: What the bag does not state, and what was taken for it.
    """

    samples: ImuSamples | None
    noise: ImuNoise | None
    T_imu_camera: SE3
    up_imu: F64
    assumed: tuple[str, ...] = ()

    def covers(self, stamps_ns: I64) -> Mask:
        """Which images (N,) lie in the time of the samples; all without a gyro."""
        if self.samples is None:
            return np.ones(len(stamps_ns), np.bool_)
        slack_ns = round(IMU_SLACK_S * 1e9)
        first, last = self.samples.stamps_ns[[0, -1]]
        inside: Mask = (stamps_ns >= first - slack_ns) & (stamps_ns <= last + slack_ns)
        return inside


WITHOUT = BagImu(None, None, SE3.identity(), UP_LEVEL_CAMERA)
"""A camera alone, taken to look straight ahead."""


def read_bag_imu(bag: Bag, chosen: Chosen, calibration_file: Path | None) -> BagImu:
    """The IMU of a robot, or `WITHOUT`.

    Raises:
        RecordingError: The samples cannot be right, or the camera's place is unknown.
    """
    if chosen.imu is None:
        return WITHOUT
    topic = chosen.imu.name
    path = Path(f"{bag.path}: {topic}")
    samples, imu_frame = read_imu(bag, topic)
    has_gyro = bool(samples.gyro.any())
    keys = {} if calibration_file is None else read_mapping(calibration_file)
    camera_frame = bag.first(chosen.image.name).header.frame_id
    if calibration_file is not None and POSE in keys:
        T_imu_camera: SE3 | None = read_pose(calibration_file)
    else:
        T_imu_camera = mounting(bag, imu_frame, camera_frame)
    if T_imu_camera is None and not has_gyro:
        return BagImu(None, None, SE3.identity(), UP_LEVEL_CAMERA, ("IMU: none, it has no gyro",))
    if T_imu_camera is None:
        raise RecordingError(
            f"{path}: where the camera sits is unknown: no static transform leads from "
            f"'{imu_frame}' to '{camera_frame}'; give a calibration with the key T_BS "
            "(--calibration FILE), or leave the IMU out with --topics imu=none"
        )
    up_imu = upwards(samples, path)
    check_up_in_camera(T_imu_camera.rotation.T @ up_imu, path)
    if not has_gyro:
        return BagImu(None, None, T_imu_camera, up_imu, ("IMU: only gravity, it has no gyro",))
    if calibration_file is not None and keys.keys() >= set(NOISE_KEYS):
        return BagImu(samples, read_imu_noise(calibration_file), T_imu_camera, up_imu)
    assumed = ("IMU: noise of an ADIS16448, as the calibration states none",)
    return BagImu(samples, ADIS16448, T_imu_camera, up_imu, assumed)
