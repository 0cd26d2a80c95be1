"""A picture being painted: a few strokes, each one pass over the pixels."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.noise import Image

Colour = tuple[float, float, float]


@dataclass
class Sheet:
    """A picture in the making.

    Attributes:
        pixels: (H, W, 3) float32 display values, 0 to 255 RGB; strokes change it in place.
        px_per_m: Its scale.
        rng: Draws what this picture has for itself.
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

    def window(self, x: float, y: float, reach_px: float) -> Sheet:
        """The part within `reach_px` of (x, y), sharing pixels and generator."""
        height, width = self.shape
        left, right = int(max(0, x - reach_px)), int(min(width, x + reach_px + 1))
        top, bottom = int(max(0, y - reach_px)), int(min(height, y + reach_px + 1))
        return Sheet(self.pixels[top:bottom, left:right], self.px_per_m, self.rng)

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


@njit(cache=True, error_model="numpy")
def _multiply(pixels: NDArray, factor: NDArray) -> None:
    for i in range(pixels.shape[0]):
        for j in range(pixels.shape[1]):
            f = factor[i, j]
            for c in range(3):
                pixels[i, j, c] *= f


@njit(cache=True, error_model="numpy")
def _blend(pixels: NDArray, colour: NDArray, cover: NDArray) -> None:
    for i in range(pixels.shape[0]):
        for j in range(pixels.shape[1]):
            f = cover[i, j]
            if f != 0:
                for c in range(3):
                    pixels[i, j, c] += (colour[c] - pixels[i, j, c]) * f


@njit(cache=True, error_model="numpy")
def light_up(pixels: NDArray, light: NDArray, out: NDArray) -> None:
    """Stretch a picture over `out`, multiply by the stretched light, round to bytes.

    Args:
        pixels: (H, W, 3) float32 display values.
        light: (h, w, 3) float32 factors of display values, coarse.
        out: (R, C, 3) uint8, overwritten.
    """
    rows, columns = out.shape[:2]
    for i in range(rows):
        y = (i + 0.5) / rows
        y0, y1, fy = _between(y, pixels.shape[0])
        v0, v1, fv = _between(y, light.shape[0])
        for j in range(columns):
            x = (j + 0.5) / columns
            x0, x1, fx = _between(x, pixels.shape[1])
            u0, u1, fu = _between(x, light.shape[1])
            for c in range(3):
                a = pixels[y0, x0, c] * (1 - fx) + pixels[y0, x1, c] * fx
                b = pixels[y1, x0, c] * (1 - fx) + pixels[y1, x1, c] * fx
                p = light[v0, u0, c] * (1 - fu) + light[v0, u1, c] * fu
                q = light[v1, u0, c] * (1 - fu) + light[v1, u1, c] * fu
                value = (a * (1 - fy) + b * fy) * (p * (1 - fv) + q * fv) + 0.5
                out[i, j, c] = np.uint8(min(max(value, 0.0), 255.0))


@njit(cache=True, error_model="numpy")
def _between(position: float, count: int) -> tuple[int, int, float]:
    """The two samples around a relative position, and how far it is toward the second."""
    exact = min(max(position * count - 0.5, 0.0), count - 1.0)
    first = int(exact)
    return first, min(first + 1, count - 1), exact - first
