"""The corners that are followed from image to image."""

from __future__ import annotations

from typing import Self

import numpy as np

from airground.core.arrays import F32, F64, I64, U8, Floats, Mask
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam.optical_flow import flow
from airground.slam.sparse_map import SparseMap

NOTHING = np.empty((0, 2), np.float32)
PATIENCE = 2
"""A point that fits the pose badly in this many images in a row is given up."""
GUIDED_LEVELS, UNGUIDED_LEVELS = 1, 3
"""Pyramid levels above the image, with a gyro and without: prediction by a gyro is better."""


class FeatureTracker:
    """Corners of the newest image, each with the number of its map point.

    Args:
        window_px: Side of the patches that are compared.
        levels: Pyramid levels above the full resolution, with a good prediction.

    Attributes:
        image: The newest image; None before the first.
        ids: (N,) numbers of the points.
        pixels: (N, 2) float32 pixels of the corners.
        failures: (N,) images in a row in which a point did not fit the pose.
    """

    def __init__(self, window_px: int, levels: int) -> None:
        self._window_px = window_px
        self._levels = levels
        self.clear()

    @classmethod
    def guided(cls, window_px: int, by_gyro: bool) -> Self:
        """A tracker whose expected pixels are predicted by a gyro, or by the motion before."""
        return cls(window_px, GUIDED_LEVELS if by_gyro else UNGUIDED_LEVELS)

    def clear(self) -> None:
        """Follow nothing any more."""
        self.image: U8 | None = None
        self.ids = np.empty(0, np.int64)
        self.pixels = NOTHING
        self.failures = np.empty(0, np.int64)

    def restart(self, image: U8) -> None:
        """Follow nothing any more, and go on from this image."""
        self.clear()
        self.image = image

    def advance(self, image: U8, start: Floats, extra_levels: int = 0) -> F32:
        """Follow every corner into the next image from its expected pixel, (N, 2) `start`.
        Corners that are not found go; `extra_levels` of the pyramid help a poor expectation.
        Returns (M, 2) where those found were before."""
        before = self.pixels
        if self.image is not None and len(self.ids):
            levels = self._levels + extra_levels
            pixels, found = flow(
                self.image, image, self.pixels, start.astype(np.float32), self._window_px, levels
            )
            before = before[found]
            self.pixels = pixels
            self.keep(found)
        self.image = image
        return before

    def keep(self, kept: Mask) -> None:
        """Give up all but the marked corners."""
        self.ids, self.pixels = self.ids[kept], self.pixels[kept]
        self.failures = self.failures[kept]

    def held_points(self) -> I64:
        """As `PointHolder.held_points`."""
        return self.ids

    def renumber(self, new: I64) -> None:
        """As `PointHolder.renumber`."""
        self.ids = new[self.ids]

    def judge(self, ids: I64, fits: Mask) -> None:
        """Note which points fitted the pose; give up those that failed too often."""
        where = np.isin(self.ids, ids)
        fitted = np.isin(self.ids, ids[fits])
        self.failures[where & ~fitted] += 1
        self.failures[fitted] = 0
        self.keep(self.failures < PATIENCE)

    def thin(self, cell_px: float) -> None:
        """Keep one corner a cell of a grid, the one known longest: seen from higher up, corners
        crowd together and would leave no room for others."""
        columns, rows = np.floor(self.pixels / cell_px).astype(np.int64).T
        by_age = np.argsort(self.ids, kind="stable")
        cells = (rows * 10_000 + columns)[by_age]
        _, first = np.unique(cells, return_index=True)
        kept = np.zeros(len(self.ids), bool)
        kept[by_age[first]] = True
        self.keep(kept)

    def add(self, ids: I64, pixels: Floats) -> None:
        """Follow further corners of the newest image."""
        self.ids = np.concatenate([self.ids, ids])
        self.pixels = np.concatenate([self.pixels, np.asarray(pixels, np.float32).reshape(-1, 2)])
        self.failures = np.concatenate([self.failures, np.zeros(len(ids), np.int64)])


def expected_pixels(
    sparse_map: SparseMap, tracker: FeatureTracker, camera: PinholeCamera, here: SE3, there: SE3
) -> F64:
    """(N, 2) pixels of the corners in the next image, by `T_map_camera` now (`here`) and as
    predicted (`there`). Corners without a map point are taken to be as far as most map points."""
    pixels = tracker.pixels.astype(np.float64)
    if len(pixels) == 0:
        return pixels
    z = (here.inverse() @ sparse_map.positions[tracker.ids])[:, 2]
    known = sparse_map.mapped(tracker.ids) & (z > 0)
    if known.any():
        z = np.where(known, z, np.median(z[known]))
    else:  # no depth to go by: only the turn counts
        z, there = np.ones(len(z)), SE3(there.rotation, here.translation)
    rays = np.column_stack([pixels, np.ones(len(z))]) @ np.linalg.inv(camera.matrix()).T
    expected = camera.project(there.inverse() @ (here @ (rays * z[:, None])))
    return np.where(np.isfinite(expected), expected, pixels)
