"""A ground map from a file, in place of the pipeline's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import open3d as o3d

from airground.core.cloud import PointCloud
from airground.errors import InputError
from airground.io.input_files import check_file

GREY = 128
"""Level of points without colours: the middle of 0 to 255."""

MAX_EXTENT_M = 1000.0
"""Largest coordinate [m]: a larger map is in another unit."""


def read_map(path: Path) -> PointCloud:
    """A cloud, or the vertices of a mesh, from any PLY file; grey without colours.

    Raises:
        InputError: The file cannot be read, or its points are none, not finite or not in metres.
    """
    _check_claim(path)
    with o3d.utility.VerbosityContextManager(o3d.utility.VerbosityLevel.Error):
        read = o3d.io.read_point_cloud(path, format="ply")
    points = np.asarray(read.points, np.float32)
    if len(points) == 0:
        raise InputError(f"{path}: no points could be read from this PLY file")
    if not np.isfinite(points).all():
        raise InputError(f"{path}: every coordinate must be a finite number")
    extent = float(np.abs(points).max())
    if extent > MAX_EXTENT_M:
        raise InputError(
            f"{path}: reaches {extent:.0f} m from its origin; expected metres, and at most "
            f"{MAX_EXTENT_M:.0f}"
        )
    colours = np.full(points.shape, GREY, np.uint8)
    if read.has_colors():
        colours = np.rint(np.asarray(read.colors) * 255).astype(np.uint8)
    return PointCloud(points, colours)


def _check_claim(path: Path) -> None:
    """Raise InputError if a header claims more elements than its file has bytes."""
    try:
        check_file(path)
        with path.open("rb") as file:
            start = file.read(4096)
        size = path.stat().st_size
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if not start.startswith(b"ply"):
        raise InputError(f"{path}: is no PLY file")
    for line in start.splitlines():
        match line.split():
            case [b"element", _, count] if not count.isdigit() or len(count) > 18:
                raise InputError(f"{path}: is damaged: a number of elements is none")
            case [b"element", _, count] if int(count) > size:
                raise InputError(
                    f"{path}: is truncated: it has {size} bytes for {int(count)} elements"
                )
