"""Direction of magnetic north in a robot's own map (Sec. VI-A: the heading is known)."""

from __future__ import annotations

import math

import numpy as np

from airground.core.arrays import F64
from airground.core.se3 import SE3, rotation_angle

BINS = 720
KERNEL_DEG = 5.0
MIN_SAMPLES = 50
MAX_SPREAD = np.deg2rad(30.0)
PLACE_M, PLACE_RAD = 0.1, np.deg2rad(10.0)
"""A robot that moved, or turned, less than this is where it was."""


class HeadingEstimator:
    """A robust running average of the magnetic field's direction in a gravity-aligned map.

    Iron nearby bends the field as long as the robot stays: the n-th sample at a place counts 1/n.

    Directions go into a histogram over the circle; the average is taken around its densest place.
    A disturbance during a minority of the time leaves no trace, unlike in a plain mean."""

    def __init__(self) -> None:
        self._samples = 0
        self._place: SE3 | None = None
        self._samples_here = 0
        self._counts = np.zeros(BINS)
        self._sums = np.zeros(BINS, np.complex128)

    def add(self, field_imu: F64, T_map_imu: SE3) -> None:
        """Take in samples (N, 3) [T] in the IMU's frame, all at one pose; NaN are left out."""
        if self._place is None or _elsewhere(self._place, T_map_imu):
            self._place, self._samples_here = T_map_imu, 0
        field = np.asarray(field_imu, np.float64).reshape(-1, 3) @ T_map_imu.rotation.T
        horizontal = field[:, 0] + 1j * field[:, 1]
        horizontal = horizontal[np.isfinite(horizontal) & (np.abs(horizontal) > 0)]
        directions = horizontal / np.abs(horizontal)
        weights = 1.0 / np.arange(self._samples_here + 1, self._samples_here + len(directions) + 1)
        self._samples_here += len(directions)
        self._samples += len(directions)
        bins = np.floor((np.angle(directions) / (2 * np.pi) + 0.5) * BINS).astype(int) % BINS
        np.add.at(self._counts, bins, weights)
        np.add.at(self._sums, bins, weights * directions)

    def heading(self) -> float | None:
        """Direction of magnetic north in the map [rad], None while too little is known."""
        if self._samples < MIN_SAMPLES:
            return None
        weights = self._weights()
        mean = (weights * self._sums).sum()
        if self._spread(weights) > MAX_SPREAD:
            return None
        return float(np.angle(mean))

    def spread(self) -> float:
        """Circular standard deviation of the directions that count [rad]; inf without any."""
        if not self._counts.any():
            return float("inf")
        return self._spread(self._weights())

    def _spread(self, weights: F64) -> float:
        length = abs((weights * self._sums).sum()) / (weights * self._counts).sum()
        return float(np.sqrt(-2 * np.log(min(length, 1.0))))

    def _weights(self) -> F64:
        """(BINS,) weight of each direction: a bell around the densest, a few kernels wide."""
        density = np.fft.irfft(np.fft.rfft(self._counts) * _SMOOTHING, BINS)
        return np.roll(_BELL, int(np.argmax(density)))


def _bell(sigma_deg: float) -> F64:
    """(BINS,) Gaussian over the circle, around the first bin."""
    distance = np.minimum(np.arange(BINS), BINS - np.arange(BINS)) * 360.0 / BINS
    return np.exp(-0.5 * (distance / sigma_deg) ** 2)


# Every image asks for the heading: what never changes is made once.
_SMOOTHING = np.fft.rfft(_bell(KERNEL_DEG))
_BELL = _bell(3 * KERNEL_DEG)


def _elsewhere(place: SE3, pose: SE3) -> bool:
    moved = math.dist(place.translation, pose.translation)
    return moved > PLACE_M or rotation_angle(place.rotation.T @ pose.rotation) > PLACE_RAD
