"""Images chosen from a recording, posed by the truth, with true points in their colours."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from evaluation.datasets.simulated import Simulated
from evaluation.datasets.true_points import Seen, colours_at, sample_surface, seen_by
from sim.robots.motion import Robot

EVERY = 10
"""Of all images every tenth: three a second. Who reconstructs from images wants no more."""
POINTS = 20_000


@dataclass(frozen=True, eq=False)
class View:
    """One image with its true pose.

    Attributes:
        robot: Whose.
        index: Of the image among all of that robot's.
        file: Where it lies in the recording.
        camera: True intrinsics.
        T_world_camera: True pose.
        seen: Which true points are in it.
    """

    robot: Robot
    index: int
    file: Path
    camera: PinholeCamera
    T_world_camera: SE3
    seen: Seen


@dataclass(frozen=True, eq=False)
class Views:
    """Images, and true points in the colours of the first image that sees them.

    Attributes:
        views: Robot by robot, in order of time.
        cloud: All points, in the world.
    """

    views: list[View]
    cloud: PointCloud

    def times_seen(self) -> np.ndarray:
        """(N,) in how many images each point is."""
        indices = [view.seen.indices for view in self.views]
        return np.bincount(np.concatenate(indices), minlength=len(self.cloud))


def choose_views(simulated: Simulated, robots: tuple[Robot, ...]) -> Views:
    """Every tenth image of each robot."""
    truth = simulated.truth
    surface = sample_surface(truth, POINTS)
    points = surface.points.astype(np.float64)
    colours = surface.colours.copy()
    coloured = np.zeros(len(points), bool)
    views = []
    for robot in robots:
        camera = truth.camera(robot)
        for index in range(0, len(simulated.stamps_ns(robot)), EVERY):
            T_world_camera = truth.T_world_camera(robot, simulated.stamps_ns(robot)[index])
            seen = seen_by(truth, camera, T_world_camera, points)
            new = ~coloured[seen.indices]
            if new.any():
                image = _image(simulated, robot, index)
                colours[seen.indices[new]] = colours_at(image, seen.pixels[new])
                coloured[seen.indices] = True
            file = simulated.image_files(robot)[index]
            views.append(View(robot, index, file, camera, T_world_camera, seen))
    return Views(views, PointCloud(surface.points, colours))


def _image(simulated: Simulated, robot: Robot, index: int) -> np.ndarray:
    if robot == "mav":
        return simulated.recording.mav.read_image(index).image
    return simulated.recording.ground.read_image(index).colour
