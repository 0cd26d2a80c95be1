"""A camera's faults: motion blur, vignetting, wandering exposure, noise, 8 bits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.presets import ImageNoise
from sim.sensors.hashed_noise import gaussian, noise_key

MAX_SAMPLES = 32
_PERIODS_S = (2.5, 20.0)
_WAVES = 6


@dataclass(frozen=True, eq=False)
class ExposureDrift:
    """A gain that wanders slowly: exp of a sum of slow waves.

    Attributes:
        amplitude: Deviation of the logarithm of the gain.
        rates: (K,) angular frequencies [rad/s].
        phases: (K,) [rad].
    """

    amplitude: float
    rates: NDArray[np.float64]
    phases: NDArray[np.float64]

    @classmethod
    def draw(cls, amplitude: float, rng: np.random.Generator) -> ExposureDrift:
        periods = np.exp(rng.uniform(np.log(_PERIODS_S[0]), np.log(_PERIODS_S[1]), _WAVES))
        return cls(amplitude, 2 * np.pi / periods, rng.uniform(0, 2 * np.pi, _WAVES))

    def gain(self, time_s: float) -> float:
        """Factor on the light at this time; 1 in the middle."""
        waves = np.sin(self.rates * time_s + self.phases).sum() * np.sqrt(2 / _WAVES)
        return float(np.exp(self.amplitude * waves))


@dataclass(frozen=True, eq=False)
class ImageSensor:
    """One camera with its faults.

    Attributes:
        camera: Its true intrinsics.
        noise: How large the faults are.
        drift: Its exposure over time.
        vignette: (height, width) float32 factor on the light, 1 in the middle.
    """

    camera: PinholeCamera
    noise: ImageNoise
    drift: ExposureDrift
    vignette: NDArray[np.float32]

    @classmethod
    def of(cls, camera: PinholeCamera, noise: ImageNoise, rng: np.random.Generator) -> ImageSensor:
        x = np.arange(camera.width) - (camera.width - 1) / 2
        y = np.arange(camera.height) - (camera.height - 1) / 2
        squared = x[None, :] ** 2 + y[:, None] ** 2
        vignette = 1 - noise.vignetting * squared / squared.max()
        drift = ExposureDrift.draw(noise.exposure_drift, rng)
        return cls(camera, noise, drift, vignette.astype(np.float32))

    def expose(
        self,
        sharp: NDArray[np.uint8],
        depth: NDArray[np.float32],
        T_start_end: SE3,
        time_s: float,
        rng: np.random.Generator,
    ) -> NDArray[np.uint8]:
        """The picture that this camera would have taken.

        Args:
            sharp: (height, width, channels) a perfect picture at the middle of the exposure.
            depth: (height, width) [m], NaN where there is nothing.
            T_start_end: How the camera moved during the exposure: its pose at the end in
                its frame at the start.
            time_s: Of the exposure, for the gain.
            rng: For the noise.

        Returns:
            (height, width, channels) uint8.
        """
        motion = pixel_motion(depth, self.camera, T_start_end)
        gain = np.float32(self.drift.gain(time_s))
        read, shot = np.float32(self.noise.read_noise**2), np.float32(self.noise.shot_noise)
        image = np.empty_like(sharp)
        for channel in range(sharp.shape[2]):
            key = noise_key(rng)
            plane = sharp[..., channel].astype(np.float32)
            _expose(plane, motion, self.vignette, gain, read, shot, key, image[..., channel])
        return image


def pixel_motion(
    depth: NDArray[np.float32], camera: PinholeCamera, T_start_end: SE3
) -> NDArray[np.float32]:
    """(height, width, 2) how far each pixel's scene point moves in the image [px].

    First order in the motion: with the camera's twist (v, w), a point X moves by
    -v - w x X, and its pixel accordingly.

    Args:
        depth: (height, width) [m]; NaN counts as infinitely far.
        camera: Intrinsics.
        T_start_end: The camera's motion.
    """
    twist = T_start_end.log().astype(np.float32)
    intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
    return _pixel_motion(depth, intrinsics, twist)


@njit(cache=True, error_model="numpy")
def _pixel_motion(depth, intrinsics, twist):  # type: ignore[no-untyped-def]
    height, width = depth.shape
    fx, fy, cx, cy = intrinsics
    vx, vy, vz, wx, wy, wz = twist
    motion = np.empty((height, width, 2), np.float32)
    for row in range(height):
        y = (row - cy) / fy
        for column in range(width):
            x = (column - cx) / fx
            inverse = np.float32(1.0) / depth[row, column]
            if not inverse > 0:
                inverse = np.float32(0.0)
            dx = -vx * inverse - (wy - wz * y)
            dy = -vy * inverse - (wz * x - wx)
            dz = -vz * inverse - (wx * y - wy * x)
            motion[row, column, 0] = fx * (dx - x * dz)
            motion[row, column, 1] = fy * (dy - y * dz)
    return motion


@njit(cache=True, error_model="numpy")
def _expose(sharp, motion, vignette, gain, read, shot, key, image):  # type: ignore[no-untyped-def]
    """Average along each pixel's motion, then light losses, noise and rounding."""
    height, width = sharp.shape
    zero, half, one = np.float32(0), np.float32(0.5), np.float32(1)
    last_x, last_y = np.float32(width - 1), np.float32(height - 1)
    for row in range(height):
        for column in range(width):
            mx, my = motion[row, column, 0], motion[row, column, 1]
            samples = min(1 + int(np.ceil(max(abs(mx), abs(my)))), MAX_SAMPLES)
            step = one / np.float32(samples)
            along = half * step - half
            light = zero
            for _ in range(samples):
                x = min(max(np.float32(column) + along * mx, zero), last_x)
                y = min(max(np.float32(row) + along * my, zero), last_y)
                along += step
                x0, y0 = min(int(x), width - 2), min(int(y), height - 2)
                ax, ay = x - np.float32(x0), y - np.float32(y0)
                top = sharp[y0, x0] + ax * (sharp[y0, x0 + 1] - sharp[y0, x0])
                bottom = sharp[y0 + 1, x0] + ax * (sharp[y0 + 1, x0 + 1] - sharp[y0 + 1, x0])
                light += top + ay * (bottom - top)
            light *= step * gain * vignette[row, column]
            light += np.sqrt(read + shot * light) * gaussian(key, row * width + column)
            image[row, column] = np.uint8(min(max(light + half, zero), np.float32(255)))
