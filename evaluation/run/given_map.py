"""A ground map from a file, in place of the pipeline's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airground.core.cloud import PointCloud
from airground.errors import InputError
from airground.io.ply_elements import Table, columns, read_elements

COLOURS = ("red", "green", "blue")
GREY = 128
"""Level of points without colours: the middle of 0 to 255."""

MAX_EXTENT_M = 1000.0
"""Largest coordinate [m]: a larger map is in another unit."""


def read_map(path: Path) -> PointCloud:
    """A cloud, or the vertices of a mesh, from any PLY file; grey without colours.

    Raises:
        InputError: The file cannot be read, or its points are none, not finite or not in metres.
    """
    table = read_elements(path, ("vertex",)).get("vertex")
    if table is None or len(table) == 0:
        raise InputError(f"{path}: no points could be read from this PLY file")
    points = columns(path, table, ("x", "y", "z"))
    if not np.isfinite(points).all():
        raise InputError(f"{path}: every coordinate must be a finite number")
    extent = float(np.abs(points).max())
    if extent > MAX_EXTENT_M:
        raise InputError(
            f"{path}: reaches {extent:.0f} m from its origin; expected metres, and at most "
            f"{MAX_EXTENT_M:.0f}"
        )
    return PointCloud(points.astype(np.float32), _colours(path, table))


def _colours(path: Path, table: Table) -> NDArray[np.uint8]:
    """(N, 3) levels: as they are, or from fractions of 1; grey without any."""
    if not set(COLOURS) <= set(table.dtype.names or ()):
        return np.full((len(table), 3), GREY, np.uint8)
    levels = columns(path, table, COLOURS)
    if table.dtype["red"].kind == "f" and not (levels > 1).any():
        levels = 255 * levels
    if not ((levels >= 0) & (levels <= 255)).all():
        raise InputError(f"{path}: a colour is not within 0 to 255")
    return np.rint(levels).astype(np.uint8)
