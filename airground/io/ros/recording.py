"""A bag as the recording of one robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from airground.core.cloud import Source
from airground.core.messages import RobotCalibration
from airground.core.se3 import SE3
from airground.errors import RecordingError
from airground.io.lens import Lens, Undistortion
from airground.io.plausibility import level_body
from airground.io.rgbd_folder import depth_scale_of
from airground.io.robot_recording import RobotRecording
from airground.io.ros import samples
from airground.io.ros.bag import Bag
from airground.io.ros.inertial import read_bag_imu
from airground.io.ros.pictures import Pictures, read_frames
from airground.io.ros.topics import Chosen, choose
from airground.io.sensor_file import read_lens

DEPTH_UNITS_PER_M = 1000.0
"""Value of one metre in depth images of integers, by REP 118."""


def open_bag(
    path: Path,
    robot: Source,
    calibration_file: Path | None = None,
    depth_units_per_m: float | None = None,
    topics: Mapping[str, str] | None = None,
) -> RobotRecording[Any]:
    """Open a bag of ROS 1 or ROS 2.

    Images outside the time of the IMU are left out, and so are images without depth.

    Args:
        path: A `.bag`, `.mcap` or `.db3` file, or the folder with a bag's `metadata.yaml`.
        robot: Robot to read: the MAV (grey), or the ground robot (colour and depth).
        calibration_file: Calibration of the camera in the form of EuRoC's `sensor.yaml`, to use in
            place of the bag's. Its `T_BS` is the camera in the IMU; an IMU's noise may be in it.
        depth_units_per_m: Value of one metre in depth images of integers; None for that of the
            calibration, or 1000.
        topics: Topics by role ("image", "depth", "info", "imu", "magnetic"), or "none"; those not
            given are found by their type.

    Raises:
        RecordingError: One line that names the bag, the topic and what would be right.
    """
    bag = Bag(path)
    chosen = choose(bag, robot, topics or {})
    lens = _lens(bag, chosen, calibration_file)
    every = read_frames(bag, chosen)
    imu = read_bag_imu(bag, chosen, calibration_file)
    frames = every.where(imu.covers(every.stamps_ns))
    assumed = imu.assumed
    if every.images.by_bag:
        assumed += ("stamps: times in the bag, as the headers have none",)
    left_out = len(every.stamps_ns) - len(frames.stamps_ns)
    if len(frames.stamps_ns) == 0:
        raise RecordingError(f"{path}: no image lies in the time of the IMU's samples")
    if left_out:
        assumed += (f"images: {left_out} outside the time of the IMU are left out",)
    undistortion = Undistortion(lens)
    scale, by_default = depth_scale_of(depth_units_per_m, calibration_file, DEPTH_UNITS_PER_M)
    pictures = Pictures(path, chosen, frames, lens, undistortion, scale)
    if chosen.depth is not None and pictures.check_scale():
        assumed += by_default
    read: Callable[[int], Any] = pictures.grey if robot == Source.MAV else pictures.registered
    recording: RobotRecording[Any] = RobotRecording(
        path=path,
        layout="ros",
        robot=robot,
        calibration=RobotCalibration(
            undistortion.camera,
            imu.T_imu_camera,
            level_body(imu.up_imu, imu.T_imu_camera),
            imu.noise,
            readout_s=undistortion.readout_s,
        ),
        camera_stamps=frames.stamps_ns,
        imu=imu.samples,
        magnetic=samples.read_magnetic(bag, chosen.magnetic.name) if chosen.magnetic else None,
        read_image=read,
        pose_frame="camera",
        T_pose_camera=SE3.identity(),
        assumed=assumed,
    )
    recording.read_image(0)
    return recording


def _lens(bag: Bag, chosen: Chosen, calibration_file: Path | None) -> Lens:
    if calibration_file is not None:
        return read_lens(calibration_file)
    if chosen.info is None:
        raise RecordingError(
            f"{bag.path}: no CameraInfo is beside {chosen.image.name}: give the calibration with "
            "--calibration FILE, or the topic with --topics info=TOPIC"
        )
    return samples.read_lens(bag, chosen.info.name, chosen.image.name)
