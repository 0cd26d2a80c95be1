"""Lens distortion, removed from images as they are read.

The result is a pinhole image of the same size without black rims, which a tracker would take for
structure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import F32, F64, U8
from airground.core.camera import PinholeCamera


@dataclass(frozen=True)
class Lens:
    """A camera as its calibration has it: a pinhole and radial-tangential distortion.

    Attributes:
        width, height: Image size [px].
        intrinsics: fx, fy, cx, cy [px]; integer pixel coordinates are pixel centres.
        distortion: k1, k2, p1, p2 and, where there is a fifth, k3.
    """

    width: int
    height: int
    intrinsics: tuple[float, float, float, float]
    distortion: tuple[float, ...]

    def matrix(self) -> F64:
        """The (3, 3) intrinsic matrix."""
        return PinholeCamera(self.width, self.height, *self.intrinsics).matrix()


class Undistortion:
    """Turns images through a lens into images of the pinhole camera `camera`."""

    def __init__(self, lens: Lens) -> None:
        self._maps: tuple[NDArray[Any], NDArray[Any]] | None = None
        self._nearest: NDArray[Any] | None = None
        size = (lens.width, lens.height)
        matrix = original = lens.matrix()
        if any(lens.distortion):
            distortion = np.array(lens.distortion)
            optimal, _ = cv2.getOptimalNewCameraMatrix(original, distortion, size, 0.0, size)
            matrix = np.asarray(optimal, np.float64)
            x, y = cv2.initUndistortRectifyMap(
                original, distortion, np.eye(3), matrix, size, cv2.CV_32FC1
            )
            self._maps = cv2.convertMaps(x, y, cv2.CV_16SC2)
            self._nearest, _ = cv2.convertMaps(x, y, cv2.CV_16SC2, nninterpolation=True)
        fx, fy, cx, cy = (float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
        self.camera = PinholeCamera(*size, fx, fy, cx, cy)

    def image(self, image: U8) -> U8:
        """Grey (H, W) or colour (H, W, 3), interpolated."""
        if self._maps is None:
            return image
        return np.asarray(cv2.remap(image, *self._maps, cv2.INTER_LINEAR), np.uint8)

    def depth(self, depth: F32) -> F32:
        """(H, W) depth [m] by the nearest pixel: neither edges nor holes (NaN) are blurred.
        Both cameras share the optical axis, hence the depth along it."""
        if self._nearest is None:
            return depth
        nothing = np.zeros((0, 0), np.uint16)
        straight = cv2.remap(
            depth,
            self._nearest,
            nothing,
            cv2.INTER_NEAREST,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=float("nan"),
        )
        return np.asarray(straight, np.float32)
