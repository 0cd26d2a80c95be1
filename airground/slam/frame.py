"""The images of one stamp as SLAM's input."""

from __future__ import annotations

from dataclasses import dataclass, replace

from airground.core.arrays import F32, U8
from airground.core.messages import RobotCalibration
from airground.core.se3 import SE3
from airground.errors import InputError
from airground.slam.rolling_shutter import GLOBAL, Shutter


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

    def turning(
        self, calibration: RobotCalibration, before: SE3, expected: SE3, before_ns: int
    ) -> Frame:
        """The same image with the shutter of a camera that turns evenly.

        Args:
            calibration: Intrinsics and readout time.
            before, expected: `T_map_camera` at the image before and as predicted for this one: the
                turn between whole images does not depend on the rows' times. That of the fitted
                pose does: straightened by it, images pull the turns of the next ones to and fro.
            before_ns: Stamp of the image before [ns].
        """
        turn = before.rotation.T @ expected.rotation
        seconds = (self.stamp_ns - before_ns) * 1e-9
        shutter = Shutter.turning(calibration.camera, calibration.readout_s, turn, seconds)
        return replace(self, shutter=shutter)


def require_order(stamp_ns: int, last_ns: int | None) -> None:
    """InputError unless an image is newer than the one before (None: there is none)."""
    if last_ns is not None and stamp_ns <= last_ns:
        raise InputError(
            f"image at {stamp_ns} ns comes after one at {last_ns} ns: stamps must increase"
        )
