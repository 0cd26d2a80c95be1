"""RGB-D odometry of Open3D and OpenCV, as front ends for the ground robot."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from airground.core.messages import GroundImage, RobotCalibration
from airground.core.se3 import SE3
from airground.slam.baselines.frame_to_frame import FrameToFrame

MAX_DEPTH_M = 5.0
MAX_DEPTH_DIFFERENCE_M = 0.07
ITERATIONS = (10, 5, 3)
"""On the coarse, middle and full resolution; Open3D's own default."""
MIN_FITNESS = 0.1
"""Share of pixels that must find a partner; the alignment has failed with fewer."""


def open3d_odometry(calibration: RobotCalibration) -> FrameToFrame:
    """Hybrid of colour and point-to-plane residuals (Park et al. 2017)."""
    return FrameToFrame(calibration, _Hybrid(calibration))


class _Hybrid:
    """Aligns two frames with `open3d.t.pipelines.odometry.rgbd_odometry_multi_scale`."""

    def __init__(self, calibration: RobotCalibration) -> None:
        # Open3D takes a second to import: only where it is used.
        import open3d

        # Its type stubs know none of the ways in which it is called.
        o3d: Any = open3d
        self._tensor, self._geometry = o3d.core.Tensor, o3d.t.geometry
        self._odometry = o3d.t.pipelines.odometry
        self._intrinsics = self._tensor(calibration.camera.matrix())
        criteria = self._odometry.OdometryConvergenceCriteria
        self._criteria = [criteria(iterations) for iterations in ITERATIONS]
        self._loss = self._odometry.OdometryLossParams(MAX_DEPTH_DIFFERENCE_M)
        self._last: tuple[int, Any] | None = None

    def align(self, previous: GroundImage, image: GroundImage) -> SE3 | None:
        """`T_previous_image`; None where too few pixels match."""
        target = self._last[1] if self._last and self._last[0] == previous.stamp_ns else None
        target = self._frame(previous) if target is None else target
        source = self._frame(image)
        try:
            result = self._odometry.rgbd_odometry_multi_scale(
                source,
                target,
                self._intrinsics,
                self._tensor(np.eye(4)),
                1.0,
                MAX_DEPTH_M,
                self._criteria,
                self._odometry.Method.Hybrid,
                self._loss,
            )
        except RuntimeError:  # a singular system
            return None
        if result.fitness < MIN_FITNESS:
            return None
        self._last = image.stamp_ns, source
        return SE3.from_matrix(result.transformation.numpy())

    def _frame(self, image: GroundImage) -> Any:
        depth = np.nan_to_num(image.depth, nan=0.0)[..., None]
        return self._geometry.RGBDImage(
            self._geometry.Image(self._tensor(np.ascontiguousarray(image.colour))),
            self._geometry.Image(self._tensor(depth)),
        )


def opencv_odometry(calibration: RobotCalibration) -> FrameToFrame:
    """Photometric and depth residuals on a pyramid (`cv2.Odometry`)."""
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
