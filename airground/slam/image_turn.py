"""The turn of the camera between two images, from the images alone.

For robots without a gyro: the small blurred image slides as a whole when the camera turns
(Klein and Murray, "Improving the agility of keyframe-based SLAM", ECCV 2008).
"""

from __future__ import annotations

import cv2
import numpy as np

from airground.core.arrays import F32, F64, U8
from airground.core.camera import PinholeCamera
from airground.slam import so3

SMALL_WIDTH = 160
MIN_RESPONSE = 0.15
"""Share of the correlation's energy in its peak: pictures that have nothing in common reach 0.12,
and a turn by half the image leaves 0.3."""


class ImageTurn:
    """Follows the turn from image to image."""

    def __init__(self, camera: PinholeCamera) -> None:
        self._camera = camera
        self._factor = max(1, round(camera.width / SMALL_WIDTH))
        size = camera.width // self._factor, camera.height // self._factor
        self._window = cv2.createHanningWindow(size, cv2.CV_32F)
        self._last: F32 | None = None

    def follow(self, image: U8) -> F64 | None:
        """(2,) turn since the last image about the camera's x and y axes [rad]; None if unclear."""
        height, width = self._window.shape
        small = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA).astype(np.float32)
        last, self._last = self._last, small
        if last is None:
            return None
        (right, down), response = cv2.phaseCorrelate(last, small, self._window)
        if response < MIN_RESPONSE:
            return None
        # What slides to the right was left of where the camera looks now.
        about_y = -np.arctan2(right * self._factor, self._camera.fx)
        about_x = np.arctan2(down * self._factor, self._camera.fy)
        return np.array([about_x, about_y])

    def rig_turn(self, image: U8, last_turn: F64, R_rig_camera: F64) -> F64:
        """(3, 3) turn of the rig to the next image, about the optical axis as in `last_turn`, the
        turn to the previous one. Where the images are not clear it is `last_turn` itself."""
        slide = self.follow(image)
        if slide is None:
            return last_turn
        about = so3.log(R_rig_camera.T @ last_turn @ R_rig_camera)
        turn = so3.exp(np.array([slide[0], slide[1], about[2]]))
        return R_rig_camera @ turn @ R_rig_camera.T
