"""Lens distortion, removed from images as they are read.

The result is a pinhole image of the same size without black rims, which a tracker would take for
structure."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import F32, F64, U8, Floats
from airground.core.camera import PinholeCamera

Model = Literal["radial-tangential", "equidistant"]

COEFFICIENTS: dict[Model, tuple[int, ...]] = {
    "radial-tangential": (4, 5, 8, 12, 14),
    "equidistant": (4,),
}
"""How many coefficients a model can have, in OpenCV's order."""
MAX_READOUT_S = 0.1
"""Rolling shutters take up to about 50 ms; a larger number is one of milliseconds."""
KINECT_READOUT_S = 0.02611
"""Readout time of the Kinect's colour camera [s] (Ringaby and Forssen, "Scan rectification for
structured light range sensors with rolling shutters", ICCV 2011)."""

MAX_HALF_ANGLE = np.deg2rad(60.0)
"""Widest view of an undistorted image from its centre to the middle of a side [rad]. A pinhole
image is stretched by 1 / cos^2 of the angle: by 4 here, without limit towards 90 degrees."""
FOCAL_STEPS = 40
"""Bisections for the focal length: they find it to a billionth."""
FOLD_STEPS = 2000
"""Angles at which a lens is held against folding: steps of a twentieth of a degree."""
MAX_FOLD_ANGLE = np.deg2rad(85.0)
"""Widest angle for which a radial-tangential model is used [rad]."""
RAY_CRITERIA = (cv2.TERM_CRITERIA_COUNT + cv2.TERM_CRITERIA_EPS, 200, 1e-13)
"""Steps and precision of the search for the ray of a pixel: 1e-10 px for a focal length of 1000."""
MAX_ZOOM = 4.0
"""Largest focal length that is tried, over the lens's own: the principal point is never so far
off the centre that an image needs more."""


@dataclass(frozen=True)
class Lens:
    """A camera as its calibration has it: a pinhole and a distortion.

    Attributes:
        width, height: Image size [px].
        intrinsics: fx, fy, cx, cy [px]; integer pixel coordinates are pixel centres.
        distortion: Coefficients in OpenCV's order. Radial-tangential: k1, k2, p1, p2; k3 fifth;
            k4, k5, k6 of the denominator up to the eighth; s1 to s4 (thin prism) up to the
            twelfth; two tilts up to the fourteenth. Equidistant: k1, k2, k3, k4.
        model: Kind of distortion.
        readout_s: Time from the first to the last row of an image [s]; 0 for a global shutter.
    """

    width: int
    height: int
    intrinsics: tuple[float, float, float, float]
    distortion: tuple[float, ...]
    model: Model = "radial-tangential"
    readout_s: float = 0.0

    def pinhole(self) -> PinholeCamera:
        """The camera without the distortion."""
        return PinholeCamera(self.width, self.height, *self.intrinsics)

    def matrix(self) -> F64:
        """The (3, 3) intrinsic matrix."""
        return self.pinhole().matrix()

    @property
    def bends(self) -> bool:
        """Whether images differ from a pinhole camera's."""
        return self.model == "equidistant" or any(self.distortion)

    def folds(self) -> bool:
        """Whether the image turns back toward its middle before it reaches its nearest side, so
        that two directions share a pixel, or no pinhole camera sees what it sees."""
        if self.bends and self.model != "equidistant" and not (_pinhole_matrix(self) >= 0).all():
            return True
        fx, fy, cx, cy = self.intrinsics
        nearest = min(cx / fx, cy / fy, (self.width - 1 - cx) / fx, (self.height - 1 - cy) / fy)
        k = np.array([*self.distortion, *np.zeros(8)])
        # The angle for a fisheye, else its tangent; tangential terms are small beside these.
        if self.model == "equidistant":
            radii = np.linspace(0, np.pi, FOLD_STEPS)
            bent = radii * np.polyval([*k[3::-1], 1.0], radii**2)
        else:
            radii = np.tan(np.linspace(0, MAX_FOLD_ANGLE, FOLD_STEPS))
            squares = radii**2
            bent = radii * np.polyval([k[4], k[1], k[0], 1.0], squares)
            with np.errstate(divide="ignore", invalid="ignore"):
                bent /= np.polyval([k[7], k[6], k[5], 1.0], squares)
        turns = np.flatnonzero(~(np.diff(bent) > 0))
        return len(turns) > 0 and not bent[turns[0]] >= nearest

    def rays(self) -> F64:
        """(height, width, 3) directions with z = 1 through every pixel centre."""
        if not self.bends:
            return self.pinhole().rays()
        columns, rows = np.meshgrid(np.arange(self.width), np.arange(self.height))
        pixels = np.stack([columns, rows], axis=-1).astype(np.float64)
        return self._rays(pixels.reshape(-1, 2)).reshape(self.height, self.width, 3)

    def _rays(self, pixels: F64) -> F64:
        """(N, 3) directions with z = 1 through pixels (N, 2)."""
        undistort: Any = (
            cv2.fisheye.undistortPoints if self.model == "equidistant" else cv2.undistortPoints
        )
        given = pixels[:, None], self.matrix(), np.array(self.distortion)
        straight = undistort(*given, criteria=RAY_CRITERIA)[:, 0]
        return np.column_stack([straight, np.ones(len(straight))])

    def project(self, points_camera: Floats) -> F64:
        """Pixels (N, 2) as (x, y) of points (N, 3) [m]; NaN where z <= 0.

        A bent lens's polynomial holds for what its image shows: NaN beyond the ray of the image's
        farthest corner."""
        if not self.bends:
            return self.pinhole().project(points_camera)
        x, y, z = np.asarray(points_camera, np.float64).T
        with np.errstate(divide="ignore", invalid="ignore"):
            straight = np.column_stack([x, y]) / np.where(z > 0, z, np.nan)[:, None]
            seen = np.hypot(*straight.T) <= _widest_tangent(self)
        pixels = np.full(straight.shape, np.nan)
        if seen.any():
            pixels[seen] = self._bent(straight[seen])
        return pixels

    def _bent(self, straight: F64) -> F64:
        """(N, 2) pixels of directions (N, 2) with z = 1."""
        matrix, distortion = self.matrix(), np.array(self.distortion)
        if self.model == "equidistant":
            pixels = cv2.fisheye.distortPoints(straight[:, None], matrix, distortion)
        else:
            rays, still = np.column_stack([straight, np.ones(len(straight))]), np.zeros(3)
            pixels, _ = cv2.projectPoints(rays, still, still, matrix, distortion)
        return np.asarray(pixels, np.float64)[:, 0]


@lru_cache(maxsize=16)
def _widest_tangent(lens: Lens) -> float:
    """Largest tangent of the angle between the optical axis and a ray through the image's edge."""
    edge = [
        (x, y)
        for x in (-0.5, lens.intrinsics[2], lens.width - 0.5)
        for y in (-0.5, lens.intrinsics[3], lens.height - 0.5)
    ]
    return float(np.hypot(*lens._rays(np.array(edge)).T[:2]).max())


class Undistortion:
    """Turns images through a lens into images of the pinhole camera `camera`."""

    def __init__(self, lens: Lens) -> None:
        self._maps: tuple[NDArray[Any], NDArray[Any]] | None = None
        self._nearest: NDArray[Any] | None = None
        size = (lens.width, lens.height)
        matrix = lens.matrix()
        if lens.bends:
            matrix, x, y = _fisheye(lens) if lens.model == "equidistant" else _radial(lens)
            self._maps = cv2.convertMaps(x, y, cv2.CV_16SC2)
            self._nearest, _ = cv2.convertMaps(x, y, cv2.CV_16SC2, nninterpolation=True)
        fx, fy, cx, cy = (float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
        self.camera = PinholeCamera(*size, fx, fy, cx, cy)
        # Rows are closer together in an image that was stretched.
        self.readout_s = lens.readout_s * lens.intrinsics[1] / fy

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


Maps = tuple[F64, NDArray[Any], NDArray[Any]]
"""The (3, 3) pinhole matrix, and for each of its pixels the x and y in the lens's image."""


def _radial(lens: Lens) -> Maps:
    size, original, distortion = (lens.width, lens.height), lens.matrix(), np.array(lens.distortion)
    matrix = _pinhole_matrix(lens)
    x, y = cv2.initUndistortRectifyMap(original, distortion, np.eye(3), matrix, size, cv2.CV_32FC1)
    return matrix, x, y


def _pinhole_matrix(lens: Lens) -> F64:
    """(3, 3) matrix of the widest pinhole camera whose pixels the lens all sees."""
    size = (lens.width, lens.height)
    distortion = np.array(lens.distortion)
    optimal, _ = cv2.getOptimalNewCameraMatrix(lens.matrix(), distortion, size, 0.0, size)
    return np.asarray(optimal, np.float64)


def _fisheye(lens: Lens) -> Maps:
    """The widest pinhole camera, up to `MAX_HALF_ANGLE`, whose pixels the lens all sees."""
    centre = (lens.width - 1) / 2, (lens.height - 1) / 2
    low = max(lens.width, lens.height) / 2 / np.tan(MAX_HALF_ANGLE)
    focal_px = low
    if not _inside(lens, _square(low, centre)):
        # Straight ahead an equidistant lens is a pinhole: at some focal length, all is inside.
        focal_px = MAX_ZOOM * max(low, *lens.intrinsics[:2])
        for _ in range(FOCAL_STEPS):
            middle = (low + focal_px) / 2
            if _inside(lens, _square(middle, centre)):
                focal_px = middle
            else:
                low = middle
    matrix = _square(focal_px, centre)
    x, y = cv2.fisheye.initUndistortRectifyMap(
        lens.matrix(),
        np.array(lens.distortion),
        np.eye(3),
        matrix,
        (lens.width, lens.height),
        cv2.CV_32FC1,
    )
    return matrix, x, y


def _square(focal_px: float, centre: tuple[float, float]) -> F64:
    return np.array([[focal_px, 0, centre[0]], [0, focal_px, centre[1]], [0, 0, 1.0]])


def _inside(lens: Lens, matrix: F64) -> bool:
    """Whether every pixel of the pinhole camera lies in the lens's image: the border decides."""
    x, y = np.arange(lens.width, dtype=np.float64), np.arange(lens.height, dtype=np.float64)
    border = np.concatenate(
        [
            *(np.column_stack([x, np.full(lens.width, side)]) for side in (0.0, y[-1])),
            *(np.column_stack([np.full(lens.height, side), y]) for side in (0.0, x[-1])),
        ]
    )
    points = ((border - matrix[:2, 2]) / matrix[[0, 1], [0, 1]])[:, None]
    bent = cv2.fisheye.distortPoints(points, lens.matrix(), np.array(lens.distortion))[:, 0]
    sides = np.array([lens.width - 1, lens.height - 1])
    return bool(np.isfinite(bent).all() and (bent >= 0).all() and (bent <= sides).all())
