"""Numbers as small lossless pictures, in the colours of the report's figures."""

from __future__ import annotations

import io

import numpy as np
import rerun as rr
from matplotlib.colors import Colormap, to_rgb
from numpy.typing import NDArray
from PIL import Image

from evaluation.figures.style import colour_map

HOLE = "#2B2E33"
"""Where there is no number: the viewer is dark."""
SHADES = 255
"""Colours of a picture; one more is for holes."""


def coloured(values: NDArray, colours: str | Colormap, low: float, high: float) -> rr.EncodedImage:
    """A picture (rows, columns) of numbers, NaN for holes; what lies beyond a limit is clipped."""
    picture = Image.fromarray(shade_index(values, low, high), mode="P")
    picture.putpalette(_palette(colours))
    packed = io.BytesIO()
    picture.save(packed, "PNG", compress_level=6)
    return rr.EncodedImage(contents=packed.getvalue(), media_type="image/png")


def shade_index(values: NDArray, low: float, high: float) -> NDArray[np.uint8]:
    """Which colour each number gets; `SHADES` for NaN."""
    share = np.clip((values - low) / max(high - low, 1e-9), 0, 1)
    index = np.where(np.isnan(share), SHADES, np.rint((SHADES - 1) * np.nan_to_num(share)))
    return index.astype(np.uint8)


def rgb(colour: str) -> tuple[int, int, int]:
    """A colour such as "#35C46A" as the viewer takes it."""
    red, green, blue = np.rint(255 * np.array(to_rgb(colour))).astype(int).tolist()
    return red, green, blue


def upright(cells: NDArray) -> NDArray:
    """Cells [ix, iy] as a picture with x to the right and y up."""
    return cells.T[::-1]


def cell_pixels(
    points: NDArray, origin: NDArray, cells_per_m: float, rows: int
) -> NDArray[np.float32]:
    """(N, 2) where points (N, 2) [m] lie on the picture of a grid.

    Args:
        points: In the frame of the grid.
        origin: (2,) centre of cell [0, 0] [m].
        cells_per_m: Resolution.
        rows: Height of the picture: cells along y.
    """
    cells = (np.asarray(points, np.float64) - origin) * cells_per_m + 0.5
    return np.stack([cells[:, 0], rows - cells[:, 1]], axis=1).astype(np.float32)


def _palette(colours: str | Colormap) -> bytes:
    shades = colour_map(colours)(np.linspace(0, 1, SHADES))[:, :3]
    return np.rint(255 * np.vstack([shades, to_rgb(HOLE)])).astype(np.uint8).tobytes()
