"""The images of one stamp as SLAM's input."""

from __future__ import annotations

from dataclasses import dataclass, replace

from airground.core.arrays import F32, U8, Floats
from airground.core.messages import RobotCalibration
from airground.errors import InputError
from airground.slam.rolling_shutter import GLOBAL, Shutter, shutter_of


@dataclass(frozen=True, eq=False)
class Frame:
    """One grey image, with depth where there is a depth camera.

    Attributes:
        image: (height, width) grey image.
        depth: (height, width) depth [m], NaN where missing; None without a depth camera.
        shutter: How the camera turned while the rows were taken, as far as it is known.
    """

    stamp_ns: int
    image: U8
    depth: F32 | None = None
    shutter: Shutter = GLOBAL

    def followed(
        self, calibration: RobotCalibration, before: Floats, here: Floats, before_ns: int
    ) -> Frame:
        """The same image with the shutter that corners show: (N, 2) pixels `before`, in the image
        at `before_ns`, and `here`."""
        seen = before, here, (self.stamp_ns - before_ns) * 1e-9
        shutter = shutter_of(calibration.camera, calibration.readout_s, *seen)
        return replace(self, shutter=shutter)


def require_order(stamp_ns: int, last_ns: int | None) -> None:
    """InputError unless an image is newer than the one before (None: there is none)."""
    if last_ns is not None and stamp_ns <= last_ns:
        raise InputError(
            f"image at {stamp_ns} ns comes after one at {last_ns} ns: stamps must increase"
        )
