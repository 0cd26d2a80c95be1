"""The depth map that the MAV made last, and how wrong it is (Fig. 6)."""

from __future__ import annotations

import cv2
import numpy as np
import rerun as rr
from numpy.typing import NDArray

from airground.core.events import DepthMapMade
from evaluation.figures.style import ERROR_COLOURS
from evaluation.rerun_view.colour_pictures import coloured
from evaluation.rerun_view.level import Level, Pace
from evaluation.rerun_view.names import TRUTH
from evaluation.rerun_view.sensor_stream import SensorStream
from evaluation.runs.onlooker import Seen
from evaluation.truth.surface_error import depth_error
from sim.truth import Truth

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
