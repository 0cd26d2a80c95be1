"""Writes the synthetic room's sequences as plain EuRoC and TUM RGB-D folders, with truth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from airground.core.messages import GroundImage, ImuSamples, MagneticSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io.calibration import CameraTable
from airground.io.euroc import camera_yaml, sensor_yaml, write_image_list, write_imu
from airground.io.tum import format_stamp, write_tum
from tests.slam.synthetic_world import IMU_HZ, IMU_NOISE, Sequence

DEPTH_UNITS_PER_M = 5000


def stepped(sequence: Sequence, index: int, step_ns: int) -> Sequence:
    """The sequence of a robot whose clock steps ahead before an image."""
    at_ns = sequence.images[index].stamp_ns - 1

    def said(stamp_ns: Any) -> Any:
        return stamp_ns + step_ns * (stamp_ns > at_ns)

    images = tuple(replace(image, stamp_ns=said(image.stamp_ns)) for image in sequence.images)
    imu, truth = sequence.imu, sequence.T_world_camera
    stamps = [image.stamp_ns for image in images]
    poses = Trajectory.from_poses(stamps, [truth[k] for k in range(len(truth))])
    late = replace(imu, stamps_ns=said(imu.stamps_ns))
    return replace(sequence, images=images, imu=late, T_world_camera=poses)


def write_tum_folder(root: Path, sequence: Sequence) -> Path:
    """Colour, depth 3 ms earlier, `groundtruth.txt` of the camera, and the calibration."""
    entries: dict[str, list[str]] = {"rgb": ["# color images"], "depth": ["# depth maps"]}
    for kind in entries:
        (root / kind).mkdir(parents=True)
    for image in sequence.images:
        assert isinstance(image, GroundImage)
        units = np.rint(np.nan_to_num(image.depth) * DEPTH_UNITS_PER_M).astype(np.uint16)
        for kind, pixels, stamp in (
            ("rgb", image.colour[..., ::-1], image.stamp_ns),
            ("depth", units, image.stamp_ns - 3_000_000),
        ):
            name = f"{kind}/{format_stamp(stamp)}.png"
            cv2.imwrite(str(root / name), pixels)
            entries[kind].append(f"{format_stamp(stamp)} {name}")
    for kind, lines in entries.items():
        (root / f"{kind}.txt").write_text("\n".join(lines) + "\n")
    yaml = camera_yaml(_camera_table(sequence), SE3.identity())
    (root / "calibration.yaml").write_text(yaml)
    write_tum(root / "groundtruth.txt", sequence.T_world_camera)
    return root


def write_euroc_folder(root: Path, sequence: Sequence) -> Path:
    """Grey images, IMU, and the estimated truth of the body, which is the IMU."""
    camera, imu, truth = (
        root / "mav0" / name for name in ("cam0", "imu0", "state_groundtruth_estimate0")
    )
    for folder in (camera / "data", imu, truth):
        folder.mkdir(parents=True)
    names = []
    for image in sequence.images:
        assert isinstance(image, MavImage)
        names.append(f"{image.stamp_ns}.png")
        cv2.imwrite(str(camera / "data" / names[-1]), image.image)
    write_image_list(camera / "data.csv", sequence.T_world_camera.stamps_ns, names)
    T_imu_camera = sequence.calibration.T_imu_camera
    yaml = camera_yaml(_camera_table(sequence), T_imu_camera)
    (camera / "sensor.yaml").write_text(f"%YAML:1.0\n{yaml}")
    write_imu(imu / "data.csv", sequence.imu)
    numbers = {
        "rate_hz": float(IMU_HZ),
        "gyroscope_noise_density": IMU_NOISE.gyro_noise_density,
        "gyroscope_random_walk": IMU_NOISE.gyro_bias_walk,
        "accelerometer_noise_density": IMU_NOISE.accelerometer_noise_density,
        "accelerometer_random_walk": IMU_NOISE.accelerometer_bias_walk,
    }
    (imu / "sensor.yaml").write_text(sensor_yaml("imu", SE3.identity(), numbers))
    write_euroc_truth(truth / "data.csv", sequence.T_world_camera, T_imu_camera.inverse())
    return root


def write_euroc_truth(path: Path, cameras: Trajectory, T_camera_body: SE3) -> None:
    rows = ["#timestamp, p_RS_R_x [m], ..., q_RS_w [], q_RS_x [], ..., v_RS_R_x [m s^-1], ..."]
    for index, stamp in enumerate(cameras.stamps_ns.tolist()):
        body = cameras[index] @ T_camera_body
        x, y, z, w = body.quaternion_xyzw()
        values = [*body.translation, w, x, y, z, 0.0, 0.0, 0.0]
        rows.append(",".join([str(stamp), *(f"{float(v):.9f}" for v in values)]))
    path.write_text("\n".join(rows) + "\n")


def _camera_table(sequence: Sequence) -> CameraTable:
    camera = sequence.calibration.camera
    return CameraTable(
        width=camera.width,
        height=camera.height,
        fx=camera.fx,
        fy=camera.fy,
        cx=camera.cx,
        cy=camera.cy,
        rate_hz=30.0,
        time_offset_ns=0,
    )


def content(message: Any) -> list[np.ndarray]:
    match message:
        case MavImage():
            return [np.array(message.stamp_ns), message.image]
        case GroundImage():
            return [np.array(message.stamp_ns), message.colour, message.depth]
        case ImuSamples():
            return [message.stamps_ns, message.gyro, message.accelerometer]
        case MagneticSamples():
            return [message.stamps_ns, message.field]
    raise TypeError(type(message))
