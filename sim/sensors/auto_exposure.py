"""Automatic exposure: a camera that brings the mean of its images to a target, late and with
overshoot.

It is computed for all images of a recording before the first is drawn, so that it does not depend
on who draws them. Light is in grey levels of the picture that the fixed exposure would give.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from airground.core.arrays import freeze
from airground.errors import InputError

WHITE = 255.0
_LEVELS = np.arange(256, dtype=np.float64)
_BLACK = 1e-3
"""Mean below which an image is taken as black [grey levels]."""
_BISECTIONS = 60


@dataclass(frozen=True)
class AutoExposure:
    """A regulator of exposure time and gain, in logarithms of their product.

    The metered image decides which product would give the target. The product follows as the
    deflection of a damped spring does; a longer exposure comes before gain.

    Attributes:
        target: Mean grey level, weighted towards the middle, that it aims at (before gamma).
        exposure_s: Shortest and longest exposure time [s].
        max_gain: Largest gain; the smallest is 1.
        delay_frames: Images from the metered one to the first that it changes.
        frequency_hz: Natural frequency of the spring [Hz].
        damping: Damping ratio; a step overshoots by exp(-pi d / sqrt(1 - d^2)) of itself.
        strength: Share of the correction that is made; 0 is a fixed exposure.
    """

    target: float
    exposure_s: tuple[float, float]
    max_gain: float
    delay_frames: int
    frequency_hz: float
    damping: float
    strength: float = 1.0

    def __post_init__(self) -> None:
        shortest, longest = self.exposure_s
        rules = (
            (0 < self.target < WHITE, "target must be between 0 and 255"),
            (0 < shortest <= longest < np.inf, "exposure_s must be a shortest and a longest time"),
            (1 <= self.max_gain < np.inf, "max_gain must be at least 1"),
            (self.delay_frames >= 1, "delay_frames must be at least 1"),
            (0 < self.frequency_hz < np.inf, "frequency_hz must be positive"),
            (0 < self.damping < np.inf, "damping must be positive"),
            (0 <= self.strength <= 1, "strength must be between 0 and 1"),
        )
        for holds, rule in rules:
            if not holds:
                raise InputError(f"automatic exposure: {rule}, got {self}")

    def limits(self, fixed_s: float) -> tuple[float, float]:
        """Smallest and largest logarithm of the factor on the light of a fixed exposure [s]."""
        shortest, longest = self.exposure_s
        return float(np.log(shortest / fixed_s)), float(np.log(longest * self.max_gain / fixed_s))


CONSUMER_EXPOSURE = AutoExposure(
    # What reflects 18 % of the light, on a display of gamma 2.2.
    target=117.0,
    # Half of the period of 30 Hz: longer ones blur.
    exposure_s=(1e-4, 0.015),
    # ISO 100 to 1600, as of the Azure Kinect's colour camera.
    max_gain=16.0,
    # Sensors with double-buffered registers expose the second image after a change by it.
    delay_frames=2,
    # OmniVision's regulators (data sheets of OV9650 and OV7675) change exposure by 1/16 per image
    # near the target: a stop takes 11 images. This spring first passes it after 0.38 s, then
    # overshoots by 16 %.
    frequency_hz=1.0,
    damping=0.5,
)

RESPONSE_709 = 0.85
"""Gamma of ITU-R BT.709, the curve of video cameras, beside a display's 2.2: within 4 grey levels
from 5 to 100 % of the light."""


@dataclass(frozen=True)
class Exposure:
    """How one image is exposed.

    Attributes:
        exposure_s: Exposure time [s].
        gain: Gain of the amplifier, on light and noise alike.
    """

    exposure_s: float
    gain: float = 1.0


@dataclass(frozen=True, eq=False)
class ExposureCourse:
    """The exposure of a camera over time.

    Attributes:
        times_ns: (N,) times of its images [ns], ascending.
        exposure_s: (N,) exposure times [s].
        gain: (N,) gains.
    """

    times_ns: NDArray[np.int64]
    exposure_s: NDArray[np.float64]
    gain: NDArray[np.float64]

    def __post_init__(self) -> None:
        count = len(self.times_ns)
        freeze(self, "times_ns", (count,), np.int64)
        freeze(self, "exposure_s", (count,), np.float64)
        freeze(self, "gain", (count,), np.float64)

    def at(self, time_ns: int) -> Exposure:
        """The exposure of the image nearest to a time [ns]."""
        nearest = int(np.abs(self.times_ns - time_ns).argmin())
        return Exposure(float(self.exposure_s[nearest]), float(self.gain[nearest]))


def regulate(
    auto: AutoExposure,
    fixed_s: float,
    rate_hz: float,
    times_ns: NDArray[np.int64],
    metered: NDArray[np.float64],
) -> ExposureCourse:
    """The exposure of each image, from what the camera meters in those before it.

    Between images the spring moves exactly, towards a desired value that is held. At the start it
    has settled.

    Args:
        auto: Parameters of the regulator.
        fixed_s: Exposure time that shows the metered light as it is [s].
        rate_hz: Rate of the images [Hz].
        times_ns: (N,) times of the images [ns].
        metered: (N, 256) share of the weighted pixels at each grey level, at these times.
    """
    limits = auto.limits(fixed_s)
    rate = 2 * np.pi * auto.frequency_hz
    step = expm(np.array([[0.0, 1.0], [-(rate**2), -2 * auto.damping * rate]]) / rate_hz)
    value, speed = _settled(auto, limits, metered[0]), 0.0
    logs = np.empty(len(metered))
    for image in range(len(metered)):
        logs[image] = np.clip(auto.strength * value, *limits)
        seen = max(image + 1 - auto.delay_frames, 0)
        desired = np.clip(_desired(auto.target, metered[seen], logs[seen]), *limits)
        off, speed = step @ (value - desired, speed)
        value = desired + off
    product_s = fixed_s * np.exp(logs)
    exposure_s = np.clip(product_s, *auto.exposure_s)
    gain = np.clip(product_s / exposure_s, 1.0, auto.max_gain)
    return ExposureCourse(times_ns, exposure_s, gain)


def _desired(target: float, metered: NDArray[np.float64], log_factor: float) -> float:
    """Logarithm of the factor that would give the target, as far as an image tells that was
    exposed by `log_factor`: what is white may be any brighter."""
    mean = metered @ np.minimum(_LEVELS * np.exp(log_factor), WHITE)
    return float(log_factor + np.log(target / max(mean, _BLACK)))


def _settled(
    auto: AutoExposure, limits: tuple[float, float], metered: NDArray[np.float64]
) -> float:
    """The value at which what is desired is what is there, within the limits."""
    low, high = limits
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        used = float(np.clip(auto.strength * middle, *limits))
        if _desired(auto.target, metered, used) > middle:
            low = middle
        else:
            high = middle
    return (low + high) / 2
