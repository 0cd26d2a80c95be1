"""Tiny folders in the exact layout of their publishers: EuRoC/ASL and TUM RGB-D."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

WIDTH, HEIGHT = 64, 48
CAMERA_START_NS = 1_403_636_579_763_555_584
IMAGES = 5

CAMERA_YAML = """%YAML:1.0
# General sensor definitions.
sensor_type: camera
comment: VI-Sensor cam0 (MT9M034)

# Sensor extrinsics wrt. the body-frame.
T_BS:
  cols: 4
  rows: 4
  data: [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975,
         0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768,
        -0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949,
         0.0, 0.0, 0.0, 1.0]

# Camera specific definitions.
rate_hz: 20
resolution: [64, 48]
camera_model: pinhole
intrinsics: [39.03, 38.92, 31.25, 21.14] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
"""
"""The numbers of EuRoC's cam0, for a twelfth of the image size."""

IMU_YAML = """%YAML:1.0
#Default imu sensor yaml file
sensor_type: imu
comment: VI-Sensor IMU (ADIS16448)

# Sensor extrinsics wrt. the body-frame.
T_BS:
  cols: 4
  rows: 4
  data: [1.0, 0.0, 0.0, 0.0,
         0.0, 1.0, 0.0, 0.0,
         0.0, 0.0, 1.0, 0.0,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 200

# inertial sensor noise model parameters (static)
gyroscope_noise_density: 1.6968e-04     # [ rad / s / sqrt(Hz) ]   ( gyro "white noise" )
gyroscope_random_walk: 1.9393e-05       # [ rad / s^2 / sqrt(Hz) ] ( gyro bias diffusion )
accelerometer_noise_density: 2.0000e-3  # [ m / s^2 / sqrt(Hz) ]   ( accel "white noise" )
accelerometer_random_walk: 3.0000e-3    # [ m / s^3 / sqrt(Hz) ].  ( accel bias diffusion )
"""

UP_IMU = np.array([9.37, -0.1, -2.9])
"""EuRoC's IMU sits with x upwards [m/s^2]."""


def camera_stamps() -> list[int]:
    return [CAMERA_START_NS + 50_000_000 * i for i in range(IMAGES)]


def grey_image(index: int) -> np.ndarray:
    return np.random.default_rng(index).integers(0, 256, (HEIGHT, WIDTH), np.uint8)


def write_euroc(root: Path) -> Path:
    """A folder with mav0 in it; lines end as on Windows, as EuRoC's do."""
    camera, imu = root / "mav0" / "cam0", root / "mav0" / "imu0"
    (camera / "data").mkdir(parents=True)
    imu.mkdir()
    (camera / "sensor.yaml").write_text(CAMERA_YAML)
    (imu / "sensor.yaml").write_text(IMU_YAML)
    lines = ["#timestamp [ns],filename"]
    for index, stamp in enumerate(camera_stamps()):
        cv2.imwrite(str(camera / "data" / f"{stamp}.png"), grey_image(index))
        lines.append(f"{stamp},{stamp}.png")
    (camera / "data.csv").write_bytes(("\r\n".join(lines) + "\r\n").encode())
    write_imu(imu / "data.csv")
    return root


def write_imu(path: Path, samples: int = 60, scale: float = 1.0) -> None:
    """200 Hz from 5 ms before the first image; `scale` multiplies what is up."""
    rows = [
        "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
        "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
    ]
    for i in range(samples):
        stamp = CAMERA_START_NS - 5_000_000 + 5_000_000 * i
        gyro = [0.01 * np.sin(i), -0.02, 0.03]
        rows.append(",".join([str(stamp), *map(repr, map(float, [*gyro, *(scale * UP_IMU)]))]))
    path.write_bytes(("\r\n".join(rows) + "\r\n").encode())


TUM_COLOUR_S = ["1305031102.175304", "1305031102.211214", "1305031102.243211", "1305031102.275326"]
TUM_DEPTH_S = ["1305031102.165407", "1305031102.201330", "1305031102.233738", "1305031102.265886"]


def write_tum(root: Path, size: tuple[int, int] = (640, 480)) -> Path:
    """Colour and depth that never share a stamp; the plane 1.5 m away has a hole."""
    width, height = size
    for kind, stamps in (("rgb", TUM_COLOUR_S), ("depth", TUM_DEPTH_S)):
        (root / kind).mkdir(parents=True)
        title = {"rgb": "color images", "depth": "depth maps"}[kind]
        lines = [f"# {title}", "# file: 'recording.bag'", "# timestamp filename"]
        for index, stamp in enumerate(stamps):
            cv2.imwrite(str(root / kind / f"{stamp}.png"), tum_image(kind, index, width, height))
            lines.append(f"{stamp} {kind}/{stamp}.png")
        (root / f"{kind}.txt").write_text("\n".join(lines) + "\n")
    return root


def tum_image(kind: str, index: int, width: int, height: int) -> np.ndarray:
    if kind == "rgb":
        colour = np.zeros((height, width, 3), np.uint8)
        colour[:] = (10 * index, 100, 200)  # blue, green, red
        return colour
    depth = np.full((height, width), 7500, np.uint16)
    depth[height // 3 : height // 2, width // 3 : width // 2] = 0
    return depth
