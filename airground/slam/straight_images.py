"""Images of a rolling shutter, as a global shutter would have taken them with the middle row.

The dense stages take a whole image at one pose. In 15 ms a MAV turns by 3 px and moves by 10 mm, so
depth maps of rows at other poses would bend. Between the image before and this one the camera is
taken to move evenly (Forssen and Ringaby, "Rectifying rolling shutter video from hand-held
devices", CVPR 2010); what a row sees is moved by its own depth where that is measured, else by the
depth of the scene's middle."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numba import njit

from airground.core.arrays import F32, F64, U8
from airground.core.camera import PinholeCamera
from airground.core.messages import GroundImage, MavImage, RobotCalibration
from airground.core.se3 import SE3
from airground.slam.front_end import TrackedPose

MAX_BETWEEN_S = 0.2
"""An older image says little of how the camera moves in this one [s]."""
STEPS = 3
"""Fixed-point steps from a straight pixel to that in the image: each leaves a hundredth of it."""


@dataclass(frozen=True, eq=False)
class Velocity:
    """Turn [rad/s] and shift [m/s] of a camera in its own axes, (3,) each."""

    turn: F64
    shift: F64

    @classmethod
    def between(cls, T_map_before: SE3, T_map_here: SE3, seconds: float) -> Velocity:
        """The even motion from one pose to another, as the other sees it."""
        back = T_map_here.inverse() @ T_map_before
        return cls(-back.rotation_vector() / seconds, -back.translation / seconds)


class StraightImages:
    """Straightens the images of one robot, which come in order of time.

    Args:
        calibration: Camera and readout time; with a global shutter images stay as they are.
    """

    def __init__(self, calibration: RobotCalibration) -> None:
        self._camera, self._readout_s = calibration.camera, calibration.readout_s
        self._before: tuple[int, SE3] | None = None
        self._velocity: tuple[int, Velocity] | None = None

    def follow(self, stamp_ns: int, pose: TrackedPose) -> None:
        """Take in the pose of every image, also of one that is not mapped."""
        T_map_camera, before = pose.T_map_camera, self._before
        self._before = None if T_map_camera is None else (stamp_ns, T_map_camera)
        # A corrected pose is beside the one before it by more than the camera's motion.
        if T_map_camera is None or before is None or pose.corrected or not self._readout_s:
            return
        seconds = (stamp_ns - before[0]) * 1e-9
        if 0 < seconds <= MAX_BETWEEN_S:
            self._velocity = stamp_ns, Velocity.between(before[1], T_map_camera, seconds)

    def mav(self, image: MavImage, depth_range: tuple[float, float] | None) -> U8:
        """(height, width) grey image as of its middle row.

        Args:
            depth_range: Nearest and farthest depth in it [m]; without one, only turns count.
        """
        velocity = self._velocity_at(image.stamp_ns)
        if velocity is None:
            return image.image
        middle = 0.0 if depth_range is None else float(np.mean(1 / np.array(depth_range)))
        everywhere = np.full((1, 1), middle, np.float32)
        places, _ = self._places(velocity, everywhere)
        return _taken(image.image, places)

    def ground(self, image: GroundImage) -> GroundImage:
        """Colour and depth as of the middle row; depth is not interpolated."""
        velocity = self._velocity_at(image.stamp_ns)
        if velocity is None:
            return image
        inverse = np.zeros_like(image.depth)
        np.divide(1, image.depth, out=inverse, where=image.depth > 0)
        places, depth = self._places(velocity, inverse)
        return replace(image, colour=_taken(image.colour, places), depth=depth)

    def _velocity_at(self, stamp_ns: int) -> Velocity | None:
        if self._velocity is None or stamp_ns - self._velocity[0] > MAX_BETWEEN_S * 1e9:
            return None
        return self._velocity[1]

    def _places(self, velocity: Velocity, inverse: F32) -> tuple[F32, F32]:
        return middle_row_view(self._camera, self._readout_s, velocity, inverse)


def middle_row_view(
    camera: PinholeCamera, readout_s: float, velocity: Velocity, inverse: F32
) -> tuple[F32, F32]:
    """Where an image shows what its middle row's pose would see.

    Args:
        readout_s: Time from the first to the last row [s].
        inverse: Inverse depth of the image's pixels [1/m], 0 where unknown; (1, 1) for all.

    Returns:
        (height, width, 2) float32 pixels (x, y) of the image, and (height, width) float32 depth
        from the middle row's pose [m]: that of the nearest pixel, NaN where unknown or outside.
    """
    places = np.empty((camera.height, camera.width, 2), np.float32)
    depth = np.empty(places.shape[:2], np.float32)
    k = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
    row_s = readout_s / max(camera.height - 1, 1)
    _find_places(inverse, k, velocity.turn * row_s, velocity.shift * row_s, places, depth)
    return places, depth


def _taken(picture: U8, places: F32) -> U8:
    nothing = np.zeros((0, 0), np.float32)
    taken = cv2.remap(picture, places, nothing, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(taken, np.uint8)


@njit(cache=True, nogil=True, error_model="numpy")
def _find_places(inverse: F32, k: F64, turn: F64, shift: F64, places: F32, depth: F32) -> None:
    """`turn` and `shift` are from one row to the next."""
    height, width = depth.shape
    known_height, known_width = inverse.shape
    middle = (height - 1) / 2
    for row in range(height):
        y = (row - k[3]) / k[1]
        for column in range(width):
            x = (column - k[2]) / k[0]
            u, v, c, own = float(column), float(row), 1.0, 0.0
            for _ in range(STEPS):
                known_row = min(max(int(v + 0.5), 0), known_height - 1)
                own = inverse[known_row, min(max(int(u + 0.5), 0), known_width - 1)] * c
                rows = v - middle
                a = x - rows * (turn[1] - turn[2] * y + own * shift[0])
                b = y - rows * (turn[2] * x - turn[0] + own * shift[1])
                c = 1.0 - rows * (turn[0] * y - turn[1] * x + own * shift[2])
                u, v = k[0] * a / c + k[2], k[1] * b / c + k[3]
            inside = -0.5 <= u < width - 0.5 and -0.5 <= v < height - 0.5
            places[row, column, 0], places[row, column, 1] = u, v
            depth[row, column] = 1 / own if inside and own > 0 else np.nan
