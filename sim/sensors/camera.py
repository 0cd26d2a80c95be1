"""A camera's faults: motion blur, vignetting, wandering exposure, gain, noise, gamma, 8 bits.

Light is in grey levels of the sharp picture. Noise is added to light; gamma comes after it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.core.se3 import SE3
from sim.sensors.auto_exposure import WHITE, Exposure
from sim.sensors.hashed_noise import gaussian, noise_key
from sim.sensors.pixel_motion import pixel_motion
from sim.sensors.pixel_rays import PixelRays
from sim.sensors.sensor_errors import ImageNoise

MAX_SAMPLES = 32
_PERIODS_S = (2.5, 20.0)
_WAVES = 6
_RESPONSE_STEPS = 65535
"""Steps of light from black to white in the table of a response: finer than a grey level wherever
light is above a millionth of white, for gammas up to 2.4."""


@dataclass(frozen=True, eq=False)
class ExposureDrift:
    """A gain that wanders slowly: exp of a sum of slow waves.

    Attributes:
        amplitude: Deviation of the logarithm of the gain.
        rates: (K,) angular frequencies [rad/s].
        phases: (K,) phases [rad].
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
        rays: Where the camera's pixels look.
        noise: Size of the faults.
        drift: Exposure over time.
        vignette: (height, width) float32 factor on the light, 1 in the middle.
        response: Grey levels of light from black to white, in even steps; empty where a grey level
            is the light, rounded.
    """

    rays: PixelRays
    noise: ImageNoise
    drift: ExposureDrift
    vignette: NDArray[np.float32]
    response: NDArray[np.uint8]

    @classmethod
    def of(cls, rays: PixelRays, noise: ImageNoise, rng: np.random.Generator) -> ImageSensor:
        camera = rays.camera
        x = np.arange(camera.width) - (camera.width - 1) / 2
        y = np.arange(camera.height) - (camera.height - 1) / 2
        squared = x[None, :] ** 2 + y[:, None] ** 2
        vignette = 1 - noise.vignetting * squared / squared.max()
        drift = ExposureDrift.draw(noise.exposure_drift, rng)
        return cls(rays, noise, drift, vignette.astype(np.float32), _response(noise.gamma))

    @property
    def fixed(self) -> Exposure:
        """The exposure that shows light as it is."""
        return Exposure(self.noise.exposure_s)

    def expose(
        self,
        sharp: NDArray[np.uint8],
        depth: NDArray[np.float32],
        T_start_end: SE3,
        time_s: float,
        rng: np.random.Generator,
        exposure: Exposure | None = None,
    ) -> NDArray[np.uint8]:
        """The picture that this camera would have taken.

        Args:
            sharp: (height, width, channels) a perfect picture at the middle of the exposure.
            depth: (height, width) [m], NaN where there is nothing.
            T_start_end: Motion of the camera during the exposure of the middle row: its pose at
                the end in its frame at the start.
            time_s: Time of the exposure, for its drift [s].
            rng: For the noise.
            exposure: Exposure time and gain, which the motion must agree with; the fixed ones if
                None. Gain is on light and noise.

        Returns:
            (height, width, channels) uint8.
        """
        planes = cv2.split(sharp)
        exposure = self.fixed if exposure is None else exposure
        gain = exposure.gain
        light = gain * _ratio(exposure.exposure_s, self.noise.exposure_s)
        keys = np.array([noise_key(rng) for _ in planes], np.uint64)
        exposed = _expose(
            np.stack(planes),
            pixel_motion(depth, self.rays, T_start_end),
            self.vignette,
            np.float32(self.drift.gain(time_s) * light),
            np.float32(self.noise.read_noise**2 * gain**2),
            np.float32(self.noise.shot_noise * gain),
            keys,
            self.response,
        )
        return np.asarray(cv2.merge(list(exposed)), np.uint8).reshape(sharp.shape)


def _ratio(exposure_s: float, fixed_s: float) -> float:
    return 1.0 if exposure_s == fixed_s else exposure_s / fixed_s


def _response(gamma: float) -> NDArray[np.uint8]:
    """Grey levels of even steps of light; none for a gamma of 1."""
    if gamma == 1:
        return np.empty(0, np.uint8)
    light = np.arange(_RESPONSE_STEPS + 1) / _RESPONSE_STEPS
    return np.rint(WHITE * light ** (1 / gamma)).astype(np.uint8)


# Each loop below does one kind of work along a row, and has no branch: so the compiler
# vectorizes all but the gathers.


@njit(cache=True, error_model="numpy")
def _expose(planes, motion, vignette, gain, read, shot, keys, response):  # type: ignore[no-untyped-def]
    """(channels, height, width): each pixel's mean along its motion, with all faults."""
    channels, height, width = planes.shape
    quads = np.empty((channels, height * width), np.uint32)
    for channel in range(channels):
        _pack_quads(planes[channel], quads[channel])
    image = np.empty_like(planes)
    samples, step = np.empty(width, np.float32), np.empty(width, np.float32)
    along = np.empty(width, np.float32)
    ax, ay = np.empty(width, np.float32), np.empty(width, np.float32)
    index, corners = np.empty(width, np.int32), np.empty(width, np.uint32)
    light = np.empty((channels, width), np.float32)
    for row in range(height):
        mx, my = motion[0, row], motion[1, row]
        most = _sampling(mx, my, samples, step, along)
        light[:] = 0
        for sample in range(most):
            _sample_places(row, height, mx, my, step, along, index, ax, ay)
            for channel in range(channels):
                _gather(quads[channel], index, corners)
                _add_sample(np.float32(sample), samples, corners, ax, ay, light[channel])
        for channel in range(channels):
            _develop(
                light[channel], step, gain, vignette[row], read, shot,
                keys[channel], row * width, response, image[channel, row],
            )  # fmt: skip
    return image


@njit(cache=True)
def _pack_quads(plane, quads):  # type: ignore[no-untyped-def]
    """Each pixel and its neighbours right, below and below right, in one word to gather."""
    height, width = plane.shape
    for row in range(height - 1):
        top, bottom = plane[row], plane[row + 1]
        words = quads[row * width : (row + 1) * width]
        for column in range(width - 1):
            words[column] = (
                np.uint32(top[column])
                | np.uint32(top[column + 1]) << np.uint32(8)
                | np.uint32(bottom[column]) << np.uint32(16)
                | np.uint32(bottom[column + 1]) << np.uint32(24)
            )


@njit(cache=True, error_model="numpy")
def _sampling(mx, my, samples, step, along):  # type: ignore[no-untyped-def]
    """How many samples each pixel takes, their spacing and the first; returns the most."""
    half, one, limit = np.float32(0.5), np.float32(1), np.float32(MAX_SAMPLES)
    most = np.float32(1)
    for column in range(len(mx)):
        count = min(one + np.ceil(max(abs(mx[column]), abs(my[column]))), limit)
        samples[column] = count
        step[column] = one / count
        along[column] = half * step[column] - half
    for column in range(len(mx)):
        most = max(most, samples[column])
    return int(most)


@njit(cache=True)
def _sample_places(row, height, mx, my, step, along, index, ax, ay):  # type: ignore[no-untyped-def]
    """Each pixel's next place along its motion: its quad and the place within, in [0, 1]."""
    width, zero = len(mx), np.float32(0)
    last_x, last_y = np.float32(width - 1), np.float32(height - 1)
    last_x0, last_y0 = np.int32(width - 2), np.int32(height - 2)
    for column in range(width):
        x = min(max(np.float32(column) + along[column] * mx[column], zero), last_x)
        y = min(max(np.float32(row) + along[column] * my[column], zero), last_y)
        along[column] += step[column]
        x0, y0 = min(np.int32(x), last_x0), min(np.int32(y), last_y0)
        ax[column], ay[column] = x - np.float32(x0), y - np.float32(y0)
        index[column] = y0 * np.int32(width) + x0


@njit(cache=True)
def _gather(quads, index, corners):  # type: ignore[no-untyped-def]
    for column in range(len(index)):
        corners[column] = quads[index[column]]


@njit(cache=True)
def _add_sample(sample, samples, corners, ax, ay, light):  # type: ignore[no-untyped-def]
    """Add the bilinear value to the light of all pixels that take this many samples."""
    byte, zero = np.uint32(255), np.float32(0)
    for column in range(len(light)):
        word = corners[column]
        left = np.float32(np.int32(word & byte))
        right = np.float32(np.int32(word >> np.uint32(8) & byte))
        low_left = np.float32(np.int32(word >> np.uint32(16) & byte))
        low_right = np.float32(np.int32(word >> np.uint32(24)))
        top = left + ax[column] * (right - left)
        bottom = low_left + ax[column] * (low_right - low_left)
        value = top + ay[column] * (bottom - top)
        light[column] += value if sample < samples[column] else zero


@njit(cache=True)
def _develop(light, step, gain, vignette, read, shot, key, first, response, image):  # type: ignore[no-untyped-def]
    """Light losses, noise and rounding; `first` is the number of the row's first pixel."""
    zero, half, white = np.float32(0), np.float32(0.5), np.float32(255)
    if len(response) > 0:
        _develop_curved(light, step, gain, vignette, read, shot, key, first, response, image)
        return
    for column in range(len(light)):
        mean = light[column] * (step[column] * gain * vignette[column])
        noisy = mean + np.sqrt(read + shot * mean) * gaussian(key, first + column)
        image[column] = np.uint8(min(max(noisy + half, zero), white))


@njit(cache=True)
def _develop_curved(light, step, gain, vignette, read, shot, key, first, response, image):  # type: ignore[no-untyped-def]
    """As `_develop`, with a response of the camera in place of the rounding."""
    zero, half, steps = np.float32(0), np.float32(0.5), np.float32(len(response) - 1)
    scale = steps / np.float32(255)
    for column in range(len(light)):
        mean = light[column] * (step[column] * gain * vignette[column])
        noisy = mean + np.sqrt(read + shot * mean) * gaussian(key, first + column)
        image[column] = response[np.int32(min(max(noisy * scale + half, zero), steps))]
