"""The two height maps, the cost of every position, and the particles on it (Fig. 7, 8)."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

from airground.core.belief import Belief, CostMap, HeightMap
from airground.core.events import BeliefUpdated, CostMapComputed, HeightMapsMade
from evaluation.run.onlooker import Seen
from evaluation.show.figures.fig08_particles import PARTICLES, ellipse_points
from evaluation.show.figures.style import COST_COLOURS, HEIGHT_COLOURS, value_range
from evaluation.show.rerun_view.images import coloured
from evaluation.show.rerun_view.sensor_stream import COSTS, TRUTH, TRUTH_COLOUR, SensorStream, rgb
from evaluation.table.truth_errors import true_T_ground_mav
from sim.recording.truth import Truth

ROOM = "localization"
TRUE_POSITION = f"{TRUTH}/position"
WHITE = (255, 255, 255)
CROSS_PX = 7.0
ROOM_TO_GROW = 1.3
"""Side of all pictures of aerial height maps, in sides of the first map."""


class Localization:
    """Input and belief of the particle filter; with truth also the true position."""

    def __init__(self, stream: SensorStream, truth: Truth | None) -> None:
        self._stream, self._truth = stream, truth
        self._cost_map: CostMap | None = None
        self._heights: HeightMapsMade | None = None
        self._aerial_cells: int | None = None
        drawn = ("particles", "covariance", "estimate", "verdict")
        parts = [f"{ROOM}/costs/{part}" for part in drawn]
        stream.put_in_frame(COSTS, f"{ROOM}/costs", *parts)
        if truth is not None:
            stream.put_in_frame(COSTS, TRUE_POSITION)

    def see(self, seen: Seen) -> None:
        stamp_ns = seen.event.stamp_ns
        match seen.event:
            case HeightMapsMade():
                self._heights = seen.event
            case CostMapComputed(cost_map=cost_map):
                self._cost_map = cost_map
                # Low is dark, as in the paper; the highest tenth is clipped.
                limits = value_range(cost_map.costs, 0, 90)
                picture = coloured(upright(cost_map.costs), COST_COLOURS, *limits)
                self._stream.log(stamp_ns, f"{ROOM}/costs", picture)
            case BeliefUpdated(belief=belief) if self._cost_map is not None:
                self._draw_heights(stamp_ns, self._cost_map)
                self._draw_belief(stamp_ns, belief, self._cost_map)
                self._draw_truth(stamp_ns, seen, self._cost_map)

    def _draw_heights(self, stamp_ns: int, cost_map: CostMap) -> None:
        """The aerial map around its camera, the ground map where there are costs; all pictures of
        an entity have one size, because the viewer treats them as a video."""
        assert self._heights is not None
        aerial, ground = self._heights.aerial, self._heights.ground
        if self._aerial_cells is None:
            self._aerial_cells = round(ROOM_TO_GROW * max(aerial.heights.shape))
        side = self._aerial_cells
        corner = np.full(2, -(side // 2) / aerial.cells_per_m)
        for name, made in (
            ("aerial", cut_out(aerial, corner, (side, side))),
            ("ground", cut_out(ground, cost_map.origin, cost_map.costs.shape)),
        ):
            low, high = value_range(made.heights, 1, 97)  # walls are clipped
            limits = low, max(high, low + 0.05)
            picture = coloured(upright(made.heights), HEIGHT_COLOURS, *limits)
            self._stream.log(stamp_ns, f"{ROOM}/{name}_heights", picture)

    def _draw_belief(self, stamp_ns: int, belief: Belief, cost_map: CostMap) -> None:
        ellipse = ellipse_points(belief.estimate[:2], belief.covariance)
        columns, rows = cost_map.costs.shape
        verdict = f"spread {belief.spread_m:.2f} m" if belief.converged else "position refused"
        parts = {
            "particles": _dots(
                on_costs(belief.particles[:, :2], cost_map), rgb(PARTICLES), 2.0, draw_order=20
            ),
            "covariance": _lines([on_costs(ellipse, cost_map)], WHITE, draw_order=30),
            "estimate": _dots(
                on_costs(belief.estimate[None, :2], cost_map), WHITE, 1.0, draw_order=31
            ),
            "verdict": _dots(
                [[columns / 2, 0.88 * rows]], WHITE, 0.5, labels=[verdict], show_labels=True
            ),
        }
        for name, drawn in parts.items():
            self._stream.log(stamp_ns, f"{ROOM}/costs/{name}", drawn)

    def _draw_truth(self, stamp_ns: int, seen: Seen, cost_map: CostMap) -> None:
        if self._truth is None or seen.sighting is None:
            return
        true = true_T_ground_mav(seen.sighting, self._truth)
        true_u = (true @ seen.sighting.surface.T_mav_camera.translation)[:2]
        middle = on_costs(true_u[None], cost_map)[0]
        arms = CROSS_PX * np.array([[[-1, 0], [1, 0]], [[0, -1], [0, 1]]], np.float32)
        cross = _lines(list(middle + arms), TRUTH_COLOUR, draw_order=40)
        self._stream.log(stamp_ns, TRUE_POSITION, cross)


def _dots(
    places: ArrayLike, colour: tuple[int, int, int], radius_pt: float, **more: Any
) -> rr.Points2D:
    return rr.Points2D(places, colors=[colour], radii=rr.Radius.ui_points(radius_pt), **more)


def _lines(
    strips: list[NDArray], colour: tuple[int, int, int], draw_order: float
) -> rr.LineStrips2D:
    radius = rr.Radius.ui_points(1.5)
    return rr.LineStrips2D(strips, colors=[colour], radii=radius, draw_order=draw_order)


def cut_out(made: HeightMap, corner: NDArray, shape: tuple[int, ...]) -> HeightMap:
    """The part of a map with `shape[0]` by `shape[1]` cells from `corner` [m]; NaN beyond it."""
    cells = np.full(shape, np.nan, np.float32)
    shift = np.rint((np.asarray(corner) - made.origin) * made.cells_per_m).astype(int)
    first = np.maximum(shift, 0)
    last = np.minimum(shift + np.array(shape), made.heights.shape)
    if (first < last).all():
        to, end = first - shift, last - shift
        cells[to[0] : end[0], to[1] : end[1]] = made.heights[first[0] : last[0], first[1] : last[1]]
    return HeightMap(cells, made.origin + shift / made.cells_per_m, made.cells_per_m)


def upright(cells: NDArray) -> NDArray:
    """Cells [ix, iy] as a picture with x to the right and y up."""
    return cells.T[::-1]


def on_costs(points_ground: NDArray, cost_map: CostMap) -> NDArray[np.float32]:
    """(N, 2) pixels of the cost map's picture for points (N, 2) in `ground` [m]."""
    points = np.asarray(points_ground, np.float64)
    cells = (points - cost_map.origin) * cost_map.cells_per_m + 0.5
    rows = cost_map.costs.shape[1]
    return np.stack([cells[:, 0], rows - cells[:, 1]], axis=1).astype(np.float32)
