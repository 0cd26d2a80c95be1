"""The pinhole camera that every image here is reduced to before a stage sees it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F64, Floats


@dataclass(frozen=True)
class PinholeCamera:
    """An undistorted pinhole camera; axes x right, y down, z forward.

    Integer pixel coordinates are pixel centres: the image covers
    [-0.5, width - 0.5] x [-0.5, height - 0.5].

    Attributes:
        width, height: Image size [px].
        fx, fy: Focal lengths [px], positive.
        cx, cy: Principal point [px].

    Raises:
        ValueError: A size or focal length is not positive.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ValueError(f"image size must be positive, got {self.width}x{self.height}")
        if not (self.fx > 0 and self.fy > 0):
            raise ValueError(f"focal lengths must be positive, got {self.fx}, {self.fy}")

    def matrix(self) -> F64:
        """The (3, 3) intrinsic matrix."""
        return np.array([[self.fx, 0, self.cx], [0, self.fy, self.cy], [0, 0, 1.0]])

    def project(self, points_camera: Floats) -> F64:
        """Pixels (N, 2) as (x, y) of points (N, 3) [m]; NaN where z <= 0."""
        x, y, z = np.asarray(points_camera, dtype=np.float64).T
        with np.errstate(divide="ignore", invalid="ignore"):
            z = np.where(z > 0, z, np.nan)
            return np.stack([self.fx * x / z + self.cx, self.fy * y / z + self.cy], axis=1)

    def rays(self) -> F64:
        """(height, width, 3) directions with z = 1 through every pixel centre."""
        x = (np.arange(self.width) - self.cx) / self.fx
        y = (np.arange(self.height) - self.cy) / self.fy
        rays = np.ones((self.height, self.width, 3))
        rays[..., 0], rays[..., 1] = x[None, :], y[:, None]
        return rays

    def back_project(self, depth: Floats) -> Floats:
        """(height, width, 3) points [m] of a depth image (height, width) [m]; NaN stays NaN."""
        if depth.shape != (self.height, self.width):
            raise ValueError(f"depth is {depth.shape}, camera {self.height}x{self.width}")
        return self.rays().astype(depth.dtype) * depth[..., None]

    def halved(self) -> PinholeCamera:
        """The camera of the image averaged over 2 x 2 pixels.
        A pixel centre at i covers 2i and 2i + 1, hence the quarter pixel."""
        return PinholeCamera(
            self.width // 2,
            self.height // 2,
            self.fx / 2,
            self.fy / 2,
            (self.cx - 0.5) / 2,
            (self.cy - 0.5) / 2,
        )
