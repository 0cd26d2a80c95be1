"""A small textured room with exact images, depth and inertial measurements, for tests of SLAM.

Boxes on a floor inside four walls, cast ray by ray; the IMU's path is a quintic spline, so
that its velocity, acceleration and turn rate are exact derivatives. The MAV looks straight
down, the ground robot ahead and a little down, both from a circle through the room. Each
starts at rest for a moment. Axes of the IMU are those of the body (x forward, z up).

    sequence = mav_sequence(frames=40)
    tracked = sequence.feed(front_end)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.ndimage import gaussian_filter
from scipy.spatial.transform import Rotation

from airground.core.camera import PinholeCamera
from airground.core.cloud import Source
from airground.core.messages import GroundImage, ImuNoise, ImuSamples, MavImage, RobotCalibration
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.front_end import FrontEnd, TrackedPose

CAMERA = PinholeCamera(320, 240, 180.0, 180.0, 159.5, 119.5)
IMU_HZ = 200
GRAVITY = np.array([0.0, 0.0, 9.81])
START_NS = 1_000_000_000
REST_S = 0.3
SPEEDING_UP_S = 0.5
MAX_DEPTH_M = 6.0
RADIUS_M = 1.3
MAV_HEIGHT_M = 2.0
GROUND_HEIGHT_M = 0.7
TEXEL_M = 0.015
TEXELS = 512

IMU_NOISE = ImuNoise(1.7e-4, 1.9e-5, 2.0e-3, 3.0e-3)
"""Of EuRoC's ADIS16448."""

R_BODY_DOWN = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Camera looking straight down, the image's top ahead."""
R_BODY_AHEAD = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Camera looking straight ahead."""
PITCH_DEG = 20.0
R_PITCH = Rotation.from_euler("y", PITCH_DEG, degrees=True).as_matrix()
T_MAV_IMU_CAMERA = SE3(R_BODY_DOWN, np.array([0.05, 0.01, -0.03]))
T_GROUND_IMU_CAMERA = SE3(R_PITCH @ R_BODY_AHEAD, np.array([0.08, 0.02, 0.05]))


@dataclass(frozen=True, eq=False)
class Sequence:
    """What one robot senses, and where it was.

    Attributes:
        robot: Who.
        calibration: Exact.
        images: In order of time.
        imu: From before the first image to after the last.
        T_world_camera: The true poses at the images' stamps.
    """

    robot: Source
    calibration: RobotCalibration
    images: tuple[MavImage, ...] | tuple[GroundImage, ...]
    imu: ImuSamples
    T_world_camera: Trajectory

    def feed(self, front_end: FrontEnd) -> list[TrackedPose]:
        """Every image through a front end, inertial samples first, then `finish`."""
        tracked = []
        previous = np.iinfo(np.int64).min
        for image in self.images:
            samples = self.imu.between(previous, image.stamp_ns)
            if len(samples.stamps_ns):
                front_end.add_imu(samples)
            tracked.append(front_end.track(image))
            previous = image.stamp_ns
        front_end.finish()
        return tracked

    def darkened(self, first: int, last: int) -> Sequence:
        """The same with images `first` to `last` - 1 black (and without depth)."""
        images = [
            _darkened(image) if first <= index < last else image
            for index, image in enumerate(self.images)
        ]
        return replace(self, images=tuple(images))


@cache
def mav_sequence(frames: int = 40, rate_hz: float = 30.0, speed_mps: float = 0.5) -> Sequence:
    """The MAV, 2 m over the boxes, swaying a little."""

    def path(t: NDArray, angle: NDArray, awake: NDArray) -> NDArray:
        x, y = RADIUS_M * np.cos(angle), RADIUS_M * np.sin(angle)
        z = MAV_HEIGHT_M + awake * 0.08 * np.sin(2 * np.pi * 0.7 * t)
        roll = awake * 0.05 * np.sin(2 * np.pi * 0.9 * t)
        pitch = awake * 0.06 * np.sin(2 * np.pi * 0.6 * t + 1)
        yaw = awake * 0.2 * np.sin(2 * np.pi * 0.2 * t)
        return np.column_stack([x, y, z, roll, pitch, yaw])

    return _sequence(Source.MAV, T_MAV_IMU_CAMERA, path, frames, rate_hz, speed_mps)


@cache
def ground_sequence(frames: int = 40, rate_hz: float = 30.0, speed_mps: float = 0.4) -> Sequence:
    """The ground robot, driving a circle around the boxes with colour and depth."""

    def path(t: NDArray, angle: NDArray, awake: NDArray) -> NDArray:
        x, y = RADIUS_M * np.cos(angle), RADIUS_M * np.sin(angle)
        z = GROUND_HEIGHT_M + awake * 0.003 * np.sin(2 * np.pi * 3.0 * t)
        roll = awake * 0.005 * np.sin(2 * np.pi * 2.0 * t)
        pitch = awake * 0.006 * np.sin(2 * np.pi * 2.5 * t + 1)
        return np.column_stack([x, y, z, roll, pitch, angle + np.pi / 2])

    return _sequence(Source.GROUND, T_GROUND_IMU_CAMERA, path, frames, rate_hz, speed_mps)


def _sequence(
    robot: Source,
    T_imu_camera: SE3,
    path: Callable[[NDArray, NDArray, NDArray], NDArray],
    frames: int,
    rate_hz: float,
    speed_mps: float,
) -> Sequence:
    return along(
        robot, T_imu_camera, _spline(path, speed_mps, frames / rate_hz + 0.5), frames, rate_hz
    )


def along(
    robot: Source,
    T_imu_camera: SE3,
    spline: BSpline,
    frames: int,
    rate_hz: float,
    imu_noise: float = 0.0,
) -> Sequence:
    """What a robot senses on its way.

    Args:
        robot: Who; its images are of that kind.
        T_imu_camera: The camera in the IMU.
        spline: x, y, z [m], roll, pitch, yaw [rad] of the IMU over time since the first image
            [s], from half a second before it to half a second after the last.
        frames, rate_hz: Of the camera [-], [Hz].
        imu_noise: Of the inertial samples, as a share of `IMU_NOISE`.
    """
    stamps = START_NS + np.rint(np.arange(frames) * 1e9 / rate_hz).astype(np.int64)
    end_s = (int(stamps[-1]) - START_NS) / 1e9 + 0.4
    poses = [_T_world_imu(spline, stamp) @ T_imu_camera for stamp in stamps]
    rng = np.random.default_rng(int(robot))
    images = tuple(
        _image(robot, int(stamp), pose, rng) for stamp, pose in zip(stamps, poses, strict=True)
    )
    calibration = RobotCalibration(
        CAMERA, T_imu_camera, SE3(np.eye(3), np.array([0.0, 0.0, 0.1])), IMU_NOISE
    )
    imu = _imu(spline, end_s)
    sigmas = (
        imu_noise
        * np.sqrt(IMU_HZ)
        * np.array([IMU_NOISE.gyro_noise_density, IMU_NOISE.accelerometer_noise_density])
    )
    imu = replace(
        imu,
        gyro=imu.gyro + rng.normal(0, sigmas[0], imu.gyro.shape),
        accelerometer=imu.accelerometer + rng.normal(0, sigmas[1], imu.gyro.shape),
    )
    return Sequence(robot, calibration, images, imu, Trajectory.from_poses(stamps.tolist(), poses))


def _spline(
    path: Callable[[NDArray, NDArray, NDArray], NDArray], speed_mps: float, end_s: float
) -> BSpline:
    """x, y, z [m], roll, pitch, yaw [rad] of the IMU over time since the first image [s]."""
    t = np.arange(-1.0, end_s + 0.5, 0.05)
    # Speed rises from zero as a smoothstep.
    part = np.clip((t - REST_S) / SPEEDING_UP_S, 0, 1)
    awake = part**2 * (3 - 2 * part)
    way = speed_mps * (SPEEDING_UP_S * (part**3 - part**4 / 2))
    way += speed_mps * np.maximum(t - REST_S - SPEEDING_UP_S, 0)
    return make_interp_spline(t, path(t, way / RADIUS_M, awake), k=5)


def _T_world_imu(spline: BSpline, stamp_ns: int) -> SE3:
    x, y, z, roll, pitch, yaw = spline((stamp_ns - START_NS) / 1e9)
    rotation = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    return SE3(rotation, np.array([x, y, z]))


def _imu(spline: BSpline, end_s: float) -> ImuSamples:
    """Exact samples without noise: R^T (a + g), and the turn rate in the IMU's axes."""
    t = np.arange(round(-0.5 * IMU_HZ), round(end_s * IMU_HZ)) / IMU_HZ
    _, _, _, roll, pitch, yaw = spline(t).T
    rate = spline.derivative()(t)[:, 3:]
    specific = spline.derivative(2)(t)[:, :3] + GRAVITY
    sin_r, cos_r, sin_p, cos_p = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    droll, dpitch, dyaw = rate.T
    gyro = np.column_stack(
        [
            droll - dyaw * sin_p,
            dpitch * cos_r + dyaw * cos_p * sin_r,
            -dpitch * sin_r + dyaw * cos_p * cos_r,
        ]
    )
    R = Rotation.from_euler("ZYX", np.column_stack([yaw, pitch, roll])).as_matrix()
    accelerometer = np.einsum("nji,nj->ni", R, specific)
    return ImuSamples(START_NS + np.rint(t * 1e9).astype(np.int64), gyro, accelerometer)


def _image(
    robot: Source, stamp_ns: int, pose: SE3, rng: np.random.Generator
) -> MavImage | GroundImage:
    grey, depth, tints = cast(pose)
    grey = grey + rng.normal(0, 1.5, grey.shape)
    if robot == Source.MAV:
        return MavImage(stamp_ns, np.rint(grey).clip(0, 255).astype(np.uint8))
    colour = np.rint(grey[..., None] * tints).clip(0, 255).astype(np.uint8)
    return GroundImage(stamp_ns, colour, np.where(depth < MAX_DEPTH_M, depth, np.nan))


def _darkened(image: MavImage | GroundImage) -> MavImage | GroundImage:
    if isinstance(image, MavImage):
        return replace(image, image=np.zeros_like(image.image))
    return replace(
        image, colour=np.zeros_like(image.colour), depth=np.full_like(image.depth, np.nan)
    )


def cast(T_world_camera: SE3) -> tuple[NDArray, NDArray[np.float32], NDArray]:
    """Grey levels (H, W), depth (H, W) [m] and tint (H, W, 3) that the camera sees."""
    boxes, tints = _room()
    rays = CAMERA.rays().reshape(-1, 3) @ T_world_camera.rotation.T
    depth, box, grey = _cast(rays, T_world_camera.translation, boxes, _texture())
    shape = (CAMERA.height, CAMERA.width)
    return (
        grey.reshape(shape),
        depth.reshape(shape).astype(np.float32),
        tints[box].reshape(*shape, 3),
    )


@cache
def _room() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(B, 2, 3) lowest and highest corners [m], the room itself first, and (B, 3) tints."""
    rng = np.random.default_rng(3)
    boxes = [[[-4.0, -4.0, 0.0], [4.0, 4.0, 3.0]]]
    for _ in range(26):
        distance, angle = rng.uniform(0.0, 3.6), rng.uniform(0, 2 * np.pi)
        if abs(distance - RADIUS_M) < 0.4:
            distance += 0.9
        centre = distance * np.array([np.cos(angle), np.sin(angle)])
        half, height = rng.uniform(0.1, 0.3, 2), rng.uniform(0.15, 0.7)
        boxes.append([[*(centre - half), 0.0], [*(centre + half), height]])
    return np.array(boxes), rng.uniform(0.75, 1.0, (len(boxes), 3))


@cache
def _texture() -> NDArray[np.float64]:
    """(T, T) smooth random grey levels that repeat without a seam."""
    rng = np.random.default_rng(4)
    noise = rng.normal(size=(TEXELS, TEXELS))
    mixed = np.zeros_like(noise)
    for sigma in (1.2, 3.0, 8.0):
        layer = gaussian_filter(noise, sigma, mode="wrap")
        mixed += layer / layer.std()
    return 125 + 38 * mixed / mixed.std()


@njit(cache=True, error_model="numpy")
def _cast(
    rays: NDArray, start: NDArray, boxes: NDArray, texture: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Distance in rays, box and grey level at the first hit of each ray (N, 3)."""
    n = len(rays)
    depth, hit, grey = np.empty(n), np.zeros(n, np.int64), np.empty(n)
    for i in range(n):
        nearest, axis, box = np.inf, 0, 0
        inverse = 1.0 / rays[i]
        for b in range(len(boxes)):
            enter, leave, enter_axis, leave_axis = -np.inf, np.inf, 0, 0
            for k in range(3):
                t0 = (boxes[b, 0, k] - start[k]) * inverse[k]
                t1 = (boxes[b, 1, k] - start[k]) * inverse[k]
                if t0 > t1:
                    t0, t1 = t1, t0
                if t0 > enter:
                    enter, enter_axis = t0, k
                if t1 < leave:
                    leave, leave_axis = t1, k
                if enter > leave:
                    break
            if b == 0 and leave < nearest:  # one is inside the room
                nearest, axis, box = leave, leave_axis, b
            elif b > 0 and 0 < enter < leave and enter < nearest:
                nearest, axis, box = enter, enter_axis, b
        point = start + nearest * rays[i]
        # Each box and face shows another part of the texture.
        u = (point[(axis + 1) % 3] + 0.83 * box + 2.1 * axis) / TEXEL_M
        v = (point[(axis + 2) % 3] + 1.37 * box) / TEXEL_M
        iu, iv = int(np.floor(u)), int(np.floor(v))
        fu, fv = u - iu, v - iv
        a, b0 = iu % TEXELS, iv % TEXELS
        c, d = (iu + 1) % TEXELS, (iv + 1) % TEXELS
        low = texture[a, b0] * (1 - fu) + texture[c, b0] * fu
        high = texture[a, d] * (1 - fu) + texture[c, d] * fu
        depth[i], hit[i], grey[i] = nearest, box, low * (1 - fv) + high * fv
    return depth, hit, grey
