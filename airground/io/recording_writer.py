"""Writes the text files of a recording; the renderer writes the images."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from airground.core.arrays import I64
from airground.core.messages import ImuSamples, MagneticSamples
from airground.core.se3 import SE3
from airground.io import layout
from airground.io.calibration import RobotTable
from airground.io.digests import file_digest, folder_digest
from airground.io.euroc import camera_yaml, sensor_yaml, write_image_list, write_imu, write_magnetic
from airground.io.header import Header, write_toml
from airground.io.sensor_file import BIAS
from airground.io.tum import format_stamp, write_accelerometer, write_image_lists


def mav_image_name(stamp_ns: int) -> str:
    return f"{stamp_ns}.png"


def ground_image_name(stamp_ns: int) -> str:
    return f"{format_stamp(stamp_ns)}.png"


def write_mav(
    root: Path, nominal: RobotTable, stamps_ns: I64, imu: ImuSamples, magnetic: MagneticSamples
) -> None:
    """Make the MAV's folders; write its samples, image list and `sensor.yaml` files (EuRoC)."""
    for folder in (layout.MAV_IMAGES, layout.MAV_IMU, layout.MAV_MAGNETOMETER):
        (root / folder).mkdir(parents=True)
    names = [mav_image_name(int(stamp)) for stamp in stamps_ns]
    write_image_list(root / layout.MAV_CAMERA_LIST, stamps_ns, names)
    yaml = camera_yaml(nominal.camera, SE3.from_matrix(nominal.T_imu_camera))
    (root / layout.MAV_CAMERA / "sensor.yaml").write_text(yaml, encoding="utf-8")
    _write_samples(root, layout.MAV_IMU, layout.MAV_MAGNETOMETER, nominal, imu, magnetic)


def write_ground(
    root: Path, nominal: RobotTable, stamps_ns: I64, imu: ImuSamples, magnetic: MagneticSamples
) -> None:
    """Make the ground robot's folders; write its samples and image lists (TUM RGB-D, samples also
    EuRoC)."""
    images = layout.GROUND_COLOUR, layout.GROUND_DEPTH
    for folder in (*images, layout.GROUND_IMU, layout.GROUND_MAGNETOMETER):
        (root / folder).mkdir(parents=True)
    names = [ground_image_name(int(stamp)) for stamp in stamps_ns]
    write_image_lists(root / "ground", stamps_ns, names)
    write_accelerometer(root / layout.GROUND_ACCELEROMETER, imu)
    _write_samples(root, layout.GROUND_IMU, layout.GROUND_MAGNETOMETER, nominal, imu, magnetic)


def finish(root: Path, header: Header, image_digests: Mapping[str, Mapping[str, str]]) -> None:
    """Write `recording.toml`, the last file, with the digests of all others.
    `header` lacks the digests; `image_digests` are SHA-256 by image folder and file name."""
    digests = {folder: folder_digest(files) for folder, files in image_digests.items()}
    for path in sorted(root.rglob("*")):
        relative = path.relative_to(root)
        parent = str(relative.parent)
        if path.is_file() and parent not in digests and relative.parts[0] != layout.TRUTH:
            digests[relative.as_posix()] = file_digest(path)
    complete = header.model_copy(update={"digests": dict(sorted(digests.items()))})
    write_toml(root / layout.HEADER, complete)


def _write_samples(
    root: Path,
    imu_folder: str,
    magnetometer_folder: str,
    nominal: RobotTable,
    imu: ImuSamples,
    magnetic: MagneticSamples,
) -> None:
    """Both sensors sit at the IMU, which is the body of EuRoC's `T_BS`."""
    write_imu(root / imu_folder / "data.csv", imu)
    write_magnetic(root / magnetometer_folder / "data.csv", magnetic)
    numbers = {
        "rate_hz": nominal.imu.rate_hz,
        "gyroscope_noise_density": nominal.imu.gyro_noise_density,
        "gyroscope_random_walk": nominal.imu.gyro_bias_walk,
        "accelerometer_noise_density": nominal.imu.accelerometer_noise_density,
        "accelerometer_random_walk": nominal.imu.accelerometer_bias_walk,
    }
    if nominal.imu.accelerometer_bias_sigma is not None:
        numbers[BIAS] = nominal.imu.accelerometer_bias_sigma
    yaml = sensor_yaml("imu", SE3.identity(), numbers)
    (root / imu_folder / "sensor.yaml").write_text(yaml, encoding="utf-8")
    numbers = {"rate_hz": nominal.magnetometer.rate_hz, "noise": nominal.magnetometer.noise_t}
    yaml = sensor_yaml("magnetometer", SE3.identity(), numbers)
    (root / magnetometer_folder / "sensor.yaml").write_text(yaml, encoding="utf-8")
