"""Compiles the kernels of SLAM before the first image arrives."""

from __future__ import annotations

from collections.abc import Collection

import cv2
import numpy as np

from airground.config import Config
from airground.core.arrays import U8
from airground.core.camera import PinholeCamera
from airground.core.cloud import Source
from airground.core.compile_once import compiling_once
from airground.core.messages import GroundImage, ImuNoise, ImuSamples, MavImage, RobotCalibration
from airground.core.se3 import SE3
from airground.slam.inertial.preintegration import GRAVITY
from airground.slam.monocular import MonocularSlam
from airground.slam.rgbd import RgbdSlam

CAMERA = PinholeCamera(320, 240, 200.0, 200.0, 159.5, 119.5)
DOWN = SE3(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
HEIGHT_M = 1.0
REST_S, SWING_S, SWING_M = 0.8, 2.4, 0.25
IMAGE_NS, IMU_NS = 50_000_000, 5_000_000
IMAGES = 90
MOVING = 24
DARK = range(70, 73)
"""Black images, so that finding the way back is compiled, too."""


def warm_up_slam(rng: np.random.Generator, robots: Collection[Source] = tuple(Source)) -> None:
    """Track a camera that swings over a flat texture, as each of these robots would; the MAV begins
    once at rest and once in motion."""
    with compiling_once("slam"):
        if Source.MAV in robots:
            _swing_mav(_texture(rng), rng)
        if Source.GROUND in robots:
            _swing_ground(_texture(rng), rng)


def _calibration() -> RobotCalibration:
    noise = ImuNoise(1e-4, 1e-5, 1e-3, 1e-4)
    return RobotCalibration(CAMERA, DOWN, SE3.identity(), noise)


def _swing_mav(texture: U8, rng: np.random.Generator) -> None:
    for first in (1, MOVING):
        mav = MonocularSlam(_calibration(), Config(), rng)
        for index in range(first, IMAGES):
            mav.add_imu(_samples(index * IMAGE_NS))
            mav.track(MavImage(index * IMAGE_NS, _image(texture, index)))
        mav.finish()


def _swing_ground(texture: U8, rng: np.random.Generator) -> None:
    ground = RgbdSlam(_calibration(), Config(), rng)
    depth = np.full((CAMERA.height, CAMERA.width), HEIGHT_M, np.float32)
    depth[:, : CAMERA.width // 3] = np.nan  # points without depth are triangulated
    for index in range(1, IMAGES):
        colour = np.repeat(_image(texture, index)[..., None], 3, axis=2)
        ground.add_imu(_samples(index * IMAGE_NS))
        ground.track(GroundImage(index * IMAGE_NS, colour, depth))
    ground.finish()


def _texture(rng: np.random.Generator) -> U8:
    noise = rng.uniform(0, 255, (480, 640)).astype(np.float32)
    smooth = cv2.GaussianBlur(noise, (0, 0), 2.0)
    result: U8 = ((smooth - smooth.min()) * (255 / np.ptp(smooth))).astype(np.uint8)
    return result


def _place(t: float) -> float:
    """Where along x the camera is after t seconds [m]."""
    swing = 2 * np.pi / SWING_S
    return SWING_M * (1 - np.cos(swing * (t - REST_S))) if t > REST_S else 0.0


def _image(texture: U8, index: int) -> U8:
    if index in DARK:
        return np.zeros((CAMERA.height, CAMERA.width), np.uint8)
    slid_px = 20.0 + _place(index * IMAGE_NS * 1e-9) * CAMERA.fx / HEIGHT_M
    shift = np.array([[1.0, 0.0, -slid_px], [0.0, 1.0, -120.0]])
    size = CAMERA.width, CAMERA.height
    return cv2.warpAffine(texture, shift, size, flags=cv2.INTER_LINEAR).astype(np.uint8)


def _samples(stamp_ns: int) -> ImuSamples:
    """What the IMU read since the image before."""
    stamps = np.arange(stamp_ns - IMAGE_NS + IMU_NS, stamp_ns + 1, IMU_NS)
    t = stamps * 1e-9
    swing = 2 * np.pi / SWING_S
    moving = t > REST_S
    force = np.zeros((len(t), 3))
    force[:, 0] = np.where(moving, SWING_M * swing**2 * np.cos(swing * (t - REST_S)), 0.0)
    force[:, 2] = GRAVITY
    return ImuSamples(stamps, np.zeros((len(t), 3)), force)
