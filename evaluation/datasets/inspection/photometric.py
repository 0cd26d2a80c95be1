"""Fit of true poses to images: images are warped into later ones, and compared.

An image is warped into another one by its depth and the true poses. If pose, depth, calibration and
stamps are right, their difference is lowest there, and higher with poses turned so that everything
lies two pixels beside. The turn that fits best, found by Gauss-Newton from the best of such places,
is the error of the truth in pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.recording.row_poses import RowPoses

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
FINE_STEPS, FINE_PX = 20, 1e-3
"""Most steps of the fit, and the step that ends it [px]."""
HUBER = 1.345
"""Residuals beyond this many deviations count less: what one image hides, or reflects."""
SHUTTER_STEPS = 3
"""Corrections of the row in which a rolling shutter sees a point: each leaves a twentieth."""


@dataclass(frozen=True)
class Posed:
    """An image and the true pose of its camera.

    Attributes:
        grey: (H, W) uint8 image.
        depth: (H, W) float32 depth [m], NaN where unknown.
        T_world_camera: True pose, of the middle row.
        rows: Poses of all rows in the frame of that pose; None with a global shutter.
    """

    grey: NDArray[np.uint8]
    depth: NDArray[np.float32]
    T_world_camera: SE3
    rows: RowPoses | None = None


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
        self._camera, self._rows = camera, second.rows
        rows, columns = np.nonzero(_edges(first.grey) & np.isfinite(first.depth))
        every = slice(None, None, 1 + len(rows) // MAX_PIXELS)
        self._at = rows[every], columns[every]
        points_first = camera.rays()[self._at] * first.depth[self._at].astype(float)[:, None]
        if first.rows is not None:
            rotations, places = first.rows.at(self._at[0].astype(float))
            points_first = np.einsum("nij,nj->ni", rotations, points_first) + places
        T_second_first = second.T_world_camera.inverse() @ first.T_world_camera
        self._points = T_second_first @ points_first

    def __len__(self) -> int:
        return len(self._points)

    def moved_px(self) -> NDArray[np.float64]:
        """(N,) motion of each pixel by the truth; NaN for those that leave the image."""
        pixels, camera = self._project(self._points), self._camera
        inside = (pixels >= 0) & (pixels <= [camera.width - 1, camera.height - 1])
        start = np.stack([self._at[1], self._at[0]], axis=1)
        return np.where(inside.all(axis=1), np.linalg.norm(pixels - start, axis=1), np.nan)

    def error(self, x_px: float, y_px: float, smoothing_px: float = SMOOTHING_PX) -> float:
        """Difference of the images with the pose turned by an offset in pixels."""
        here, there = self._smooth[smoothing_px]
        points = self._turned(x_px, y_px) @ self._points
        return _difference(here[self._at], _sample(there, self._project(points)))

    def fitted(self, x_px: float, y_px: float) -> NDArray[np.float64]:
        """(2,) the offset [px] near a start at which the images differ least, brightness and
        contrast apart; the start, if there is none within `SHIFT_PX`."""
        here, there = self._smooth[SMOOTHING_PX]
        slopes = [_slope(there, *axis) for axis in ((1, 0), (0, 1))]
        wanted, start = here[self._at], np.array([x_px, y_px])
        offset, weights = start, np.ones(len(self))
        for _ in range(FINE_STEPS):
            pixels = self._project(self._turned(*offset) @ self._points)
            seen, *slope = (_sample(image, pixels) for image in (there, *slopes))
            # wanted = contrast * (seen + slope . step) + brightness
            model = np.stack([*slope, seen, np.ones(len(self))], axis=1)
            both = np.isfinite(model).all(axis=1)
            root = np.sqrt(weights[both])[:, None]
            found, *_ = np.linalg.lstsq(root * model[both], root[:, 0] * wanted[both], rcond=None)
            misfit = np.abs(np.where(both, wanted - model @ found, 0.0))
            deviation = 1.4826 * np.median(misfit[both]) + 1e-9
            weights = np.minimum(1.0, HUBER * deviation / np.maximum(misfit, 1e-9))
            step = found[:2] / found[2] if found[2] > 0 else np.full(2, np.inf)
            offset = offset + step
            if not np.abs(offset - start).max() <= SHIFT_PX:
                return start
            if np.abs(step).max() < FINE_PX:
                break
        return offset

    def _turned(self, x_px: float, y_px: float) -> SE3:
        return SE3.from_rotation_vector((-y_px / self._camera.fy, x_px / self._camera.fx, 0.0))

    def _project(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, 2) pixels of points in the second camera at its middle row; with a rolling shutter
        each is seen from the pose of the row that it falls into."""
        pixels = self._camera.project(points)
        if self._rows is None:
            return pixels
        last = self._camera.height - 1
        for _ in range(SHUTTER_STEPS):
            rotations, places = self._rows.at(np.clip(np.nan_to_num(pixels[:, 1]), 0, last))
            seen = np.einsum("nji,nj->ni", rotations, points - places)
            pixels = self._camera.project(seen)
        return pixels


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
    # Descend from there: the coarse steps are wider than the reach of the fit.
    best = compared.error(x, y)
    for _ in range(MAX_STEPS):
        places = [(x + dx, y + dy) for dx, dy in BESIDE]
        beside = [compared.error(*place) for place in places]
        if not np.isfinite([best, *beside]).all():
            return None
        if min(beside) >= best:
            return Fit(compared.fitted(x, y), float(np.mean(beside)) / max(best, 1e-9))
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


def _slope(image: NDArray[np.float32], along_x: int, along_y: int) -> NDArray[np.float32]:
    return np.asarray(cv2.Sobel(image, cv2.CV_32F, along_x, along_y, scale=1 / 8), np.float32)


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
