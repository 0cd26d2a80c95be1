"""The depth map that the MAV made last and its error (Fig. 6); numbers as coloured pictures."""

from __future__ import annotations

import io

import cv2
import numpy as np
import rerun as rr
from matplotlib.colors import Colormap, to_rgb
from numpy.typing import NDArray
from PIL import Image

from airground.core.events import DepthMapMade
from evaluation.run.onlooker import Seen
from evaluation.show.figures.style import ERROR_COLOURS, colour_map
from evaluation.show.rerun_view.sensor_stream import TRUTH, Level, Pace, SensorStream
from evaluation.table.truth_errors import depth_error
from sim.recording.truth import Truth

STEP_M = 1e-3
"""Depth is kept in whole steps of this."""
SHOWN_PERCENTILES = (1, 99)
LEAST_RANGE_M = 0.1
ERROR_LIMIT_M = 0.03
"""The error's full colour: blue is too near, red too far."""


class DepthMaps:
    """Depth maps as they are made.

    Args:
        stream: To draw on.
        level: How often.
        truth: Where given, errors are drawn too.
    """

    def __init__(self, stream: SensorStream, level: Level, truth: Truth | None) -> None:
        self._stream, self._truth = stream, truth
        self._pace = Pace(level.depth_map_hz)

    def see(self, seen: Seen) -> None:
        """Draw a depth map."""
        match seen.event:
            case DepthMapMade(stamp_ns=stamp_ns, depth_map=made) if self._pace.due(stamp_ns):
                self._stream.log(stamp_ns, "mav/depth_map", encoded_depth(made.depth))
                if self._truth is not None:
                    error = depth_error(made.depth, made.camera, made.stamp_ns, self._truth)
                    picture = coloured(error, ERROR_COLOURS, -ERROR_LIMIT_M, ERROR_LIMIT_M)
                    self._stream.log(stamp_ns, f"{TRUTH}/depth_error", picture)


def encoded_depth(depth: NDArray[np.float32]) -> rr.EncodedDepthImage:
    """Depth [m] as a PNG of 16 bits; NaN becomes 0."""
    steps = np.rint(np.nan_to_num(depth, nan=0.0) / STEP_M).clip(0, np.iinfo(np.uint16).max)
    _, png = cv2.imencode(".png", steps.astype(np.uint16))
    seen = depth[np.isfinite(depth)]
    near, far = np.percentile(seen, SHOWN_PERCENTILES) if len(seen) else (0.0, 1.0)
    # Holes have the darkest colour to themselves.
    limits = (near - max(far - near, LEAST_RANGE_M) / 3, far)
    return rr.EncodedDepthImage(
        blob=png.tobytes(),
        media_type="image/png",
        meter=1 / STEP_M,
        colormap=rr.components.Colormap.Viridis,
        depth_range=np.asarray(limits) / STEP_M,
    )


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
