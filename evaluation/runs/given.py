"""What a user brings along in place of a stage: trajectories, and a map of the ground."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import open3d as o3d

from airground.core.cloud import PointCloud
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.ground_map import FixedMap
from airground.pipeline import Pipeline

GREY = 128
MAX_EXTENT_M = 1000.0
"""A larger map is in another unit."""


@dataclass(frozen=True, eq=False)
class Given:
    """Results of other systems; None where ours do the work.

    Attributes:
        mav, ground: Poses `T_map_camera`, metric with z up.
        ground_map: In the frame of the ground robot's poses.
    """

    mav: Trajectory | None = None
    ground: Trajectory | None = None
    ground_map: PointCloud | None = None

    def robots(self) -> frozenset[str]:
        """Those of "mav" and "ground" whose poses are given."""
        poses = {"mav": self.mav, "ground": self.ground}
        return frozenset(robot for robot, given in poses.items() if given is not None)

    def describe(self) -> str:
        """How results name what was replaced; empty where nothing was."""
        parts = {"MAV poses": self.mav, "ground poses": self.ground, "ground map": self.ground_map}
        names = [name for name, given in parts.items() if given is not None]
        return f"{', '.join(names)} from a file" if names else ""

    def enter(self, pipeline: Pipeline) -> None:
        """Put the map in place of the one that the pipeline would make."""
        if self.ground_map is not None:
            pipeline.mapping.ground_map = FixedMap(self.ground_map)


NOTHING = Given()


def read_map(path: Path) -> PointCloud:
    """A cloud, or the vertices of a mesh, from a PLY file of any kind; grey without colours.

    Raises:
        InputError: It cannot be read, is empty, not finite, or too large to be in metres.
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
    """InputError where a header claims more points than its file has bytes."""
    try:
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
