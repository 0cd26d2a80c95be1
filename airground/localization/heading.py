"""Where magnetic north lies in a robot's own map (Sec. VI-A: the heading is known)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BINS = 720
KERNEL_DEG = 5.0
MIN_SAMPLES = 50
MAX_SPREAD = np.deg2rad(30.0)


class HeadingEstimator:
    """A robust running average of the magnetic field's direction in a gravity-aligned map.

    Directions go into a histogram over the circle, so that memory does not grow; the
    average is taken around its densest place. A disturbance that lasts a minority of the
    time then leaves no trace, where a plain mean would bend towards it.
    """

    def __init__(self) -> None:
        self._counts = np.zeros(BINS)
        self._sums = np.zeros(BINS, np.complex128)

    def add(self, field_imu: NDArray, R_map_imu: NDArray) -> None:
        """Take in magnetic field samples.

        Args:
            field_imu: (N, 3) [T] in the IMU's frame; samples with a NaN are left out.
            R_map_imu: (3, 3) the IMU's orientation in the map when they were taken.
        """
        field = np.asarray(field_imu, np.float64).reshape(-1, 3) @ np.asarray(R_map_imu).T
        horizontal = field[:, 0] + 1j * field[:, 1]
        horizontal = horizontal[np.isfinite(horizontal) & (np.abs(horizontal) > 0)]
        directions = horizontal / np.abs(horizontal)
        bins = np.floor((np.angle(directions) / (2 * np.pi) + 0.5) * BINS).astype(int) % BINS
        np.add.at(self._counts, bins, 1)
        np.add.at(self._sums, bins, directions)

    def heading(self) -> float | None:
        """Direction of magnetic north in the map [rad], None while too little is known."""
        if self._counts.sum() < MIN_SAMPLES:
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

    def _spread(self, weights: NDArray) -> float:
        length = abs((weights * self._sums).sum()) / (weights * self._counts).sum()
        return float(np.sqrt(-2 * np.log(min(length, 1.0))))

    def _weights(self) -> NDArray[np.float64]:
        """(BINS,) weight of each direction: a bell around the densest, a few kernels wide."""
        distance = np.minimum(np.arange(BINS), BINS - np.arange(BINS)) * 360.0 / BINS
        kernel = np.exp(-0.5 * (distance / KERNEL_DEG) ** 2)
        density = np.fft.irfft(np.fft.rfft(self._counts) * np.fft.rfft(kernel), BINS)
        bell = np.exp(-0.5 * (distance / (3 * KERNEL_DEG)) ** 2)
        return np.roll(bell, int(np.argmax(density)))
