"""Fit of true poses to images: images are warped into later ones, and compared.

An image is warped into another one by its depth and the true poses. If pose, depth, calibration and
stamps are right, their difference is lowest there, and higher with poses turned so that everything
lies two pixels beside. The minimum of the parabola through these three errors is the error of the
truth in pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3

SHIFT_PX = 2.0
SMOOTHING_PX = 1.5
"""Wide enough that the difference falls towards the truth from two pixels away."""
COARSE_PX = np.arange(-24.0, 25.0, 6.0)
COARSE_SMOOTHING_PX = 6.0
"""Of the search that comes first; beyond it an offset is only known to be large."""
BESIDE = ((-SHIFT_PX, 0.0), (SHIFT_PX, 0.0), (0.0, -SHIFT_PX), (0.0, SHIFT_PX))
MAX_STEPS = 20
EDGES = 0.2
"""Share of the pixels that are compared: those at the strongest edges."""
MAX_PIXELS = 10_000
MIN_PIXELS = 500
MIN_SHARED = 0.2
"""Share of one image that the other shows; with less, the pose is not that of this camera."""
MIN_MOTION_PX = 4.0
"""Least median motion of pixels between two images: with less, any pose would fit."""


@dataclass(frozen=True)
class Posed:
    """An image and the true pose of its camera.

    Attributes:
        grey: (H, W) uint8 image.
        depth: (H, W) float32 depth [m], NaN where unknown.
        T_world_camera: True pose.
    """

    grey: NDArray[np.uint8]
    depth: NDArray[np.float32]
    T_world_camera: SE3


@dataclass(frozen=True)
class Fit:
    """Fit of one image to another.

    Attributes:
        offset_px: (2,) error of the truth in x and y; infinite where it maps most of the one
            image out of the other.
        rise: Mean difference two pixels beside the best place, over that at the best.
    """

    offset_px: NDArray[np.float64]
    rise: float


ELSEWHERE = Fit(np.full(2, np.inf), np.nan)


class Comparison:
    """Compares two images of one camera at poses turned a little; the first needs depth."""

    def __init__(self, first: Posed, second: Posed, camera: PinholeCamera) -> None:
        self._smooth = {
            px: (_smooth(first.grey, px), _smooth(second.grey, px))
            for px in (SMOOTHING_PX, COARSE_SMOOTHING_PX)
        }
        self._camera = camera
        rows, columns = np.nonzero(_edges(first.grey) & np.isfinite(first.depth))
        every = slice(None, None, 1 + len(rows) // MAX_PIXELS)
        self._at = rows[every], columns[every]
        points_first = camera.rays()[self._at] * first.depth[self._at].astype(float)[:, None]
        T_second_first = second.T_world_camera.inverse() @ first.T_world_camera
        self._points = T_second_first @ points_first

    def __len__(self) -> int:
        return len(self._points)

    def moved_px(self) -> NDArray[np.float64]:
        """(N,) motion of each pixel by the truth; NaN for those that leave the image."""
        pixels, camera = self._camera.project(self._points), self._camera
        inside = (pixels >= 0) & (pixels <= [camera.width - 1, camera.height - 1])
        start = np.stack([self._at[1], self._at[0]], axis=1)
        return np.where(inside.all(axis=1), np.linalg.norm(pixels - start, axis=1), np.nan)

    def error(self, x_px: float, y_px: float, smoothing_px: float = SMOOTHING_PX) -> float:
        """Difference of the images with the pose turned by an offset in pixels."""
        here, there = self._smooth[smoothing_px]
        camera = self._camera
        turn = SE3.from_rotation_vector((-y_px / camera.fy, x_px / camera.fx, 0.0))
        return _difference(here[self._at], _sample(there, camera.project(turn @ self._points)))


def fit(first: Posed, second: Posed, camera: PinholeCamera) -> Fit | None:
    """Fit the first image to the second; None where too little is visible, or moves."""
    compared = Comparison(first, second, camera)
    if len(compared) < MIN_PIXELS:
        return None
    moved = compared.moved_px()
    if np.isfinite(moved).mean() < MIN_SHARED:
        return ELSEWHERE
    if np.nanmedian(moved) < MIN_MOTION_PX:
        return None
    coarse = {
        (x, y): compared.error(x, y, COARSE_SMOOTHING_PX) for x in COARSE_PX for y in COARSE_PX
    }
    if np.isnan(coarse[0.0, 0.0]):
        return None
    x, y = min(coarse, key=lambda place: np.nan_to_num(coarse[place], nan=np.inf))
    # Descend from there: the coarse steps are wider than the parabola.
    best = compared.error(x, y)
    for _ in range(MAX_STEPS):
        places = [(x + dx, y + dy) for dx, dy in BESIDE]
        beside = [compared.error(*place) for place in places]
        if not np.isfinite([best, *beside]).all():
            return None
        if min(beside) >= best:
            offset = np.array(
                [x + _lowest(beside[0], best, beside[1]), y + _lowest(beside[2], best, beside[3])]
            )
            return Fit(offset, float(np.mean(beside)) / max(best, 1e-9))
        best = min(beside)
        x, y = places[int(np.argmin(beside))]
    return None


def fits(
    posed: Callable[[int], Posed | None], pairs: list[tuple[int, int]], camera: PinholeCamera
) -> list[Fit]:
    """Fits of all pairs of images that can be compared."""
    found = []
    for i, j in pairs:
        first, second = posed(i), posed(j)
        one = None if first is None or second is None else fit(first, second, camera)
        if one is not None:
            found.append(one)
    return found


def _edges(grey: NDArray[np.uint8]) -> NDArray[np.bool_]:
    smooth = _smooth(grey, SMOOTHING_PX)
    strength = np.hypot(cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1))
    return strength > np.quantile(strength, 1 - EDGES)


def _smooth(grey: NDArray[np.uint8], by_px: float) -> NDArray[np.float32]:
    smooth = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), by_px)
    return np.asarray(smooth, np.float32)


def _sample(image: NDArray[np.float32], pixels: NDArray) -> NDArray[np.float32]:
    """(N,) interpolated, NaN outside."""
    xy = np.nan_to_num(pixels, nan=-1e6)
    return map_coordinates(image, xy.T[::-1], order=1, cval=np.nan)


def _difference(here: NDArray, there: NDArray) -> float:
    """Mean absolute difference without brightness and contrast, since exposure changes."""
    both = np.isfinite(there)
    if both.sum() < MIN_PIXELS:
        return float("nan")
    a, b = here[both], there[both]
    return float(np.abs((a - a.mean()) / a.std() - (b - b.mean()) / (b.std() + 1e-9)).mean())


def _lowest(before: float, here: float, after: float) -> float:
    """Minimum of the parabola through errors at -SHIFT, 0 and SHIFT [px]."""
    bend = before - 2 * here + after
    return SHIFT_PX * (before - after) / (2 * bend) if bend > 0 else 0.0
