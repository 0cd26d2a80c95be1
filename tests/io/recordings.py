"""A small recording made by hand: four images a robot, 24 x 16 pixels."""

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from airground.core.messages import ImuSamples, MagneticSamples
from airground.core.se3 import SE3
from airground.io import layout
from airground.io.calibration import (
    CalibrationTable,
    CameraTable,
    DepthTable,
    GroundTable,
    ImuTable,
    MagnetometerTable,
    RobotTable,
    pose_rows,
)
from airground.io.digests import file_digest
from airground.io.header import FrameCounts, Header
from airground.io.recording_writer import (
    finish,
    ground_image_name,
    mav_image_name,
    write_ground,
    write_mav,
)

WIDTH, HEIGHT, UNITS_PER_M = 24, 16, 5000.0
MAV_STAMPS = np.array([50_000_000, 83_333_333, 116_666_667, 150_000_000])
GROUND_STAMPS = MAV_STAMPS + 5_000_000
SAMPLE_STAMPS = np.arange(0, 200_000_001, 5_000_000)


def calibration() -> CalibrationTable:
    robot = RobotTable(
        T_body_imu=pose_rows(SE3.from_heading(0.3, (0.01, 0.02, 0.03))),
        T_imu_camera=pose_rows(SE3.from_rotation_vector((0.1, -2.0, 0.4), (0.1, 0.0, -0.05))),
        camera=CameraTable(
            width=WIDTH,
            height=HEIGHT,
            fx=20.0,
            fy=21.0,
            cx=11.5,
            cy=7.5,
            rate_hz=30.0,
            time_offset_ns=0,
        ),
        imu=ImuTable(
            rate_hz=200.0,
            gyro_noise_density=1e-4,
            gyro_bias_walk=1e-5,
            accelerometer_noise_density=1e-3,
            accelerometer_bias_walk=1e-3,
        ),
        magnetometer=MagnetometerTable(rate_hz=200.0, noise_t=1e-7),
    )
    ground = GroundTable(**dict(robot), depth=DepthTable(units_per_m=UNITS_PER_M))
    return CalibrationTable(mav=robot, ground=ground)


def imu_samples() -> ImuSamples:
    rng = np.random.default_rng(1)
    n = len(SAMPLE_STAMPS)
    gravity = np.array([0.0, 0.0, 9.81])
    return ImuSamples(SAMPLE_STAMPS, rng.normal(size=(n, 3)), gravity + rng.normal(size=(n, 3)))


def magnetic_samples() -> MagneticSamples:
    field = np.random.default_rng(2).normal(0, 1e-5, (len(SAMPLE_STAMPS), 3))
    return MagneticSamples(SAMPLE_STAMPS, field)


def images(index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Grey (MAV), RGB and depth units (ground robot); one pixel in ten has no depth."""
    rng = np.random.default_rng(index)
    grey = rng.integers(0, 256, (HEIGHT, WIDTH), np.uint8)
    colour = rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
    units = rng.integers(2500, 25000, (HEIGHT, WIDTH)).astype(np.uint16)
    units[rng.random((HEIGHT, WIDTH)) < 0.1] = 0
    return grey, colour, units


def write_recording(root: Path, robots: Sequence[str] = ("mav", "ground")) -> Path:
    nominal = calibration()
    if "mav" in robots:
        write_mav(root, nominal.mav, MAV_STAMPS, imu_samples(), magnetic_samples())
    if "ground" in robots:
        write_ground(root, nominal.ground, GROUND_STAMPS, imu_samples(), magnetic_samples())
    folders = [folder for folder in layout.IMAGE_FOLDERS if (root / folder).exists()]
    digests: dict[str, dict[str, str]] = {folder: {} for folder in folders}
    for index, (mav, ground) in enumerate(zip(MAV_STAMPS, GROUND_STAMPS, strict=True)):
        grey, colour, units = images(index)
        for folder, name, image in (
            (layout.MAV_IMAGES, mav_image_name(int(mav)), grey),
            (layout.GROUND_COLOUR, ground_image_name(int(ground)), colour[..., ::-1]),
            (layout.GROUND_DEPTH, ground_image_name(int(ground)), units),
        ):
            if folder in folders:
                cv2.imwrite(str(root / folder / name), image)
                digests[folder][name] = file_digest(root / folder / name)
    header = Header(
        scene="indoor_a",
        seed=7,
        flight=1,
        sensors="nominal",
        duration_s=0.2,
        frames=FrameCounts(**{r: 4 if r in robots else 0 for r in ("mav", "ground")}),
        calibration=nominal,
        digests={},
    )
    finish(root, header, digests)
    return root
