"""Fronts of houses: plaster or brickwork, rows of windows, a door."""

from __future__ import annotations

import cv2
import numpy as np

from sim.appearance.masonry import paint_brickwork
from sim.appearance.sheet import Colour, Sheet
from sim.geometry.noise import Image, octave_noise

STOREY_M = 2.9
WINDOW_M = (1.0, 1.4)
"""Width and height [m]."""
_PLASTERS: tuple[Colour, ...] = (
    (206, 190, 156), (188, 196, 190), (214, 206, 196), (196, 160, 132), (176, 184, 198),
)  # fmt: skip
_FRAMES: tuple[Colour, ...] = ((232, 230, 224), (92, 70, 52), (70, 82, 76))
_GLASS: Colour = (52, 62, 72)
_SILL: Colour = (168, 164, 156)
_BRICK_SHARE = 0.3


def paint_front(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Image:
    """The front of a house, or what is narrower than a window without any."""
    if rng.random() < _BRICK_SHARE:
        pixels = paint_brickwork(size_m, px_per_m, rng)
    else:
        pixels = _plaster(size_m, px_per_m, rng)
    if min(size_m) > WINDOW_M[1] + 0.6:
        _openings(Sheet(pixels, pixels.shape[1] / size_m[0], rng), size_m)
    return pixels


def _plaster(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Image:
    width, height = (max(48, round(edge * px_per_m)) for edge in size_m)
    tone = 1 + 0.05 * octave_noise((height, width), px_per_m, 3, rng, 0.7)
    tone += 0.02 * rng.standard_normal((height, width), np.float32)
    foot = np.linspace(size_m[1], 0, height, dtype=np.float32)[:, None]
    tone -= 0.18 * np.exp(-foot / 0.4)
    colour = np.array(_PLASTERS[rng.integers(len(_PLASTERS))], np.float32)
    return np.asarray(colour * tone[..., None], np.float32)


def _openings(sheet: Sheet, size_m: tuple[float, float]) -> None:
    """Windows at even distances in every storey, a door in place of one on the ground."""
    width, height = size_m
    columns = max(1, int((width - 0.8) / (WINDOW_M[0] + 0.9)))
    frame = _FRAMES[sheet.rng.integers(len(_FRAMES))]
    door = int(sheet.rng.integers(columns))
    for storey in range(max(1, int((height - 0.3) / STOREY_M))):
        for column in range(columns):
            x = (column + 0.5) * width / columns
            foot = height - storey * STOREY_M
            if storey == 0 and column == door:
                _rectangle(sheet, x, foot - 1.05, 1.1, 2.1, frame)
                _rectangle(sheet, x, foot - 0.95, 0.9, 1.85, (84, 60, 44))
                continue
            middle = foot - 1.0 - WINDOW_M[1] / 2
            _rectangle(sheet, x, middle, WINDOW_M[0] + 0.16, WINDOW_M[1] + 0.16, frame)
            shade = float(sheet.rng.uniform(0.7, 1.5))
            for side in (-1, 1):
                r, g, b = (shade * value for value in _GLASS)
                pane = WINDOW_M[0] / 2 - 0.06
                _rectangle(sheet, x + side * WINDOW_M[0] / 4, middle, pane, WINDOW_M[1], (r, g, b))
            _rectangle(sheet, x, middle + WINDOW_M[1] / 2 + 0.12, WINDOW_M[0] + 0.3, 0.09, _SILL)


def _rectangle(
    sheet: Sheet, x_m: float, y_m: float, width_m: float, height_m: float, colour: Colour
) -> None:
    """A filled rectangle around (x, y) from the upper left corner."""
    scale = sheet.px_per_m
    low = (round((x_m - width_m / 2) * scale), round((y_m - height_m / 2) * scale))
    high = (round((x_m + width_m / 2) * scale) - 1, round((y_m + height_m / 2) * scale) - 1)
    cv2.rectangle(sheet.pixels, low, high, colour, -1)
