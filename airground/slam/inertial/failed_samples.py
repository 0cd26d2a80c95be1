"""Inertial samples that measure nothing: not finite, all zero, or at the end of the range."""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64, I64, Mask
from airground.core.messages import ImuSamples

CLIPPING_GYRO = 1.0
"""No gyro's range ends below this [rad/s]; the smallest in use is 2.2 rad/s (125 deg/s)."""
CLIPPING_ACCELEROMETER = 15.0
"""No accelerometer's range ends below this [m/s^2]; the smallest in use is 2 g."""
FEWEST = 3
"""Equal readings in a row of an axis at its largest magnitude so far: noise leaves no three."""
MAX_GYRO_STEP = 2.0
"""Largest change of a rate from sample to sample [rad/s]: 400 rad/s^2 at 200 Hz, more than any
robot here turns faster."""
NEXT_NS = 12_000_000
"""Samples farther apart than this are not compared [ns]."""


class FailedSamples:
    """Tells samples that were measured from those that a failing sensor returns.

    A dead sensor reads zero on all axes, where at rest it would read gravity. A saturated one
    leaps to the end of its range, or repeats it to the last bit.
    """

    def __init__(self) -> None:
        self._floor = np.repeat([CLIPPING_GYRO, CLIPPING_ACCELEROMETER], 3)
        self._peak = self._floor.copy()
        self._last = np.full(6, np.nan)
        self._run = np.zeros(6, np.int64)
        self._good, self._good_ns = np.full(3, np.nan), 0
        self._leapt = False

    def left_out(self, samples: ImuSamples) -> ImuSamples:
        """The next samples without those that are no measurement."""
        good = self.measured(samples)
        if good.all():
            return samples
        return ImuSamples(samples.stamps_ns[good], samples.gyro[good], samples.accelerometer[good])

    def measured(self, samples: ImuSamples) -> Mask:
        """(N,) whether each sample of the next ones is a measurement."""
        readings = np.hstack([samples.gyro, samples.accelerometer])
        good = np.asarray(np.isfinite(readings).all(axis=1) & readings.any(axis=1), np.bool_)
        if (np.abs(readings) >= self._floor).any():
            good &= ~self._clipped(samples.stamps_ns, readings)
        else:
            self._run[:] = 0
        if good.any():
            newest = int(np.flatnonzero(good)[-1])
            self._good, self._good_ns = readings[newest, :3], int(samples.stamps_ns[newest])
        return good

    def _clipped(self, stamps_ns: I64, readings: F64) -> Mask:
        """(N,) whether each sample leaps to its largest magnitude, or an axis repeats it."""
        clipped = np.zeros(len(readings), bool)
        for row, (stamp_ns, reading) in enumerate(zip(stamps_ns, readings, strict=True)):
            size = np.abs(reading)
            self._peak = np.fmax(self._peak, size)
            at_end = (size >= self._peak) & (size > self._floor)
            goes_on = at_end & (reading == self._last)
            self._run = np.where(goes_on, self._run + 1, at_end.astype(np.int64))
            leaps = np.abs(reading[:3] - self._good) > MAX_GYRO_STEP
            near = stamp_ns - self._good_ns < NEXT_NS
            self._leapt = bool(
                (near and (leaps & at_end[:3]).any()) or (self._leapt and goes_on.any())
            )
            clipped[row] = self._leapt
            longest = int(self._run.max())
            if longest >= FEWEST:
                clipped[max(row + 1 - longest, 0) : row + 1] = True
            if not clipped[row]:
                self._good, self._good_ns = reading[:3], int(stamp_ns)
            self._last = reading
        return clipped
