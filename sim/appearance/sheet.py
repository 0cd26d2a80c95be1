"""A picture being painted: a few strokes, each one pass over the pixels."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.geometry.noise import Image

Colour = tuple[float, float, float]


@dataclass
class Sheet:
    """A picture in the making.

    Attributes:
        pixels: (H, W, 3) float32 display values, 0 to 255 RGB; strokes change it in place.
        px_per_m: Scale of the picture [px/m].
        rng: Source of the features of this picture alone.
    """

    pixels: Image
    px_per_m: float
    rng: np.random.Generator

    @property
    def shape(self) -> tuple[int, int]:
        return self.pixels.shape[0], self.pixels.shape[1]

    def darken(self, factor: NDArray) -> None:
        """Multiply by an (H, W) factor."""
        _multiply(self.pixels, factor.astype(np.float32, copy=False))

    def blend(self, colour: Colour, cover: NDArray) -> None:
        """Paint `colour` where `cover` (H, W), 0 to 1, says."""
        _blend(self.pixels, np.array(colour, np.float32), cover.astype(np.float32, copy=False))

    def window(self, x: float, y: float, reach_px: float) -> tuple[Sheet, float, float]:
        """The part within `reach_px` of (x, y), sharing pixels and generator; (x, y) in it."""
        height, width = self.shape
        left, right = int(max(0, x - reach_px)), int(min(width, x + reach_px + 1))
        top, bottom = int(max(0, y - reach_px)), int(min(height, y + reach_px + 1))
        part = Sheet(self.pixels[top:bottom, left:right], self.px_per_m, self.rng)
        return part, x - left, y - top

    def crease(
        self, start: tuple[float, float], end: tuple[float, float], depth: float, width_px: int = 1
    ) -> None:
        """A dark line with a lit edge beside it."""
        dark = np.zeros(self.shape, np.uint8)
        a, b = ((round(x), round(y)) for x, y in (start, end))
        cv2.line(dark, a, b, 255, width_px, cv2.LINE_AA)
        lit = np.roll(dark, (width_px + 1, width_px + 1), (0, 1))
        tone = dark.astype(np.float32) * np.float32(-depth / 255)
        tone += lit * np.float32(0.35 * depth / 255)
        self.darken(1 + tone)


@njit(cache=True, error_model="numpy", nogil=True)
def _multiply(pixels: NDArray, factor: NDArray) -> None:
    for i in range(pixels.shape[0]):
        for j in range(pixels.shape[1]):
            f = factor[i, j]
            for c in range(3):
                pixels[i, j, c] *= f


@njit(cache=True, error_model="numpy", nogil=True)
def _blend(pixels: NDArray, colour: NDArray, cover: NDArray) -> None:
    for i in range(pixels.shape[0]):
        for j in range(pixels.shape[1]):
            f = cover[i, j]
            if f != 0:
                for c in range(3):
                    pixels[i, j, c] += (colour[c] - pixels[i, j, c]) * f


def fixed_point(points: NDArray) -> NDArray[np.int32]:
    """Points in eighths of a pixel, as cv2 needs them for smooth lines."""
    return np.round(points * 8).astype(np.int32)


def faded(pixels: NDArray, contrast: float) -> NDArray:
    """A picture (..., 3) with `contrast` times its contrast around its mean colour."""
    if contrast == 1.0:
        return pixels
    mean = pixels.mean(axis=tuple(range(pixels.ndim - 1)), dtype=np.float64)
    return np.asarray(mean + contrast * (pixels - mean), np.float32)


@njit(cache=True, error_model="numpy", nogil=True)
def light_up(pixels: NDArray, light: NDArray, out: NDArray) -> None:
    """Stretch a picture over `out` (R, C, 3) uint8, multiply by the stretched light, round.

    `pixels` (H, W, 3) and the coarse factors `light` (h, w, 3) are float32 display values.
    """
    rows, columns = out.shape[:2]
    # Rows of the two, stretched along x: the upper and the lower that a row of `out` is between.
    shown, lit = np.empty((2, 3 * columns)), np.empty((2, 3 * columns))
    shown_rows, lit_rows = np.full(2, -1), np.full(2, -1)
    for i in range(rows):
        y = (i + 0.5) / rows
        fy = _rows_around(y, pixels, shown_rows, shown)
        fv = _rows_around(y, light, lit_rows, lit)
        _multiply_rows(shown[0], shown[1], fy, lit[0], lit[1], fv, out[i].reshape(-1))


@njit(cache=True, error_model="numpy")
def _multiply_rows(  # type: ignore[no-untyped-def]
    shown_above, shown_below, fy, lit_above, lit_below, fv, out
):
    for k in range(len(out)):
        shown = shown_above[k] * (1 - fy) + shown_below[k] * fy
        lit = lit_above[k] * (1 - fv) + lit_below[k] * fv
        out[k] = np.uint8(min(max(shown * lit + 0.5, 0.0), 255.0))


@njit(cache=True, error_model="numpy")
def _rows_around(y: float, image: NDArray, held: NDArray, stretched: NDArray) -> float:
    """Have `stretched` (2, 3 C) hold the rows around height `y`, 0 (top) to 1; `held` lists them.
    Returns the share of the lower row.
    """
    first, second, share = _between(y, image.shape[0])
    if held[1] == first:
        stretched[0] = stretched[1]
        held[0] = first
    for k, row in enumerate((first, second)):
        if held[k] != row:
            _stretch_row(image[row], stretched[k])
            held[k] = row
    return share


@njit(cache=True, error_model="numpy")
def _stretch_row(row: NDArray, out: NDArray) -> None:
    columns = len(out) // 3
    for j in range(columns):
        first, second, share = _between((j + 0.5) / columns, len(row))
        for c in range(3):
            out[3 * j + c] = row[first, c] * (1 - share) + row[second, c] * share


@njit(cache=True, error_model="numpy")
def _between(position: float, count: int) -> tuple[int, int, float]:
    """The two samples around a relative position, and how far it is toward the second."""
    exact = min(max(position * count - 0.5, 0.0), count - 1.0)
    first = int(exact)
    return first, min(first + 1, count - 1), exact - first
