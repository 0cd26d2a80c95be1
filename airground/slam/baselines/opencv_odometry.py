"""OpenCV's RGB-D odometry: photometric and depth residuals on a pyramid (`cv2.Odometry`)."""

from __future__ import annotations

import cv2
import numpy as np

from airground.core.messages import GroundImage, RobotCalibration
from airground.core.se3 import SE3
from airground.slam.baselines.frame_to_frame import FrameToFrame


def opencv_odometry(calibration: RobotCalibration) -> FrameToFrame:
    """Front end for the ground robot."""
    return FrameToFrame(calibration, _RgbDepth(calibration))


class _RgbDepth:
    """Aligns two frames with `cv2.Odometry`, colour and depth together."""

    def __init__(self, calibration: RobotCalibration) -> None:
        settings = cv2.OdometrySettings()
        settings.setCameraMatrix(calibration.camera.matrix().astype(np.float32))
        self._odometry = cv2.Odometry(
            cv2.OdometryType_RGB_DEPTH, settings, cv2.OdometryAlgoType_COMMON
        )

    def align(self, previous: GroundImage, image: GroundImage) -> SE3 | None:
        """`T_previous_image`; None where OpenCV says that it failed."""
        # The pose that OpenCV finds carries points of the first frame into the second.
        found, matrix = self._odometry.compute(
            np.array(image.depth), image.colour, np.array(previous.depth), previous.colour
        )
        if not found or not np.isfinite(matrix).all():
            return None
        return SE3.from_matrix(matrix)
