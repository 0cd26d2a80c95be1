"""Images chosen from a recording, with true poses, and points of the true surface in them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.errors import InputError
from airground.io.lens import Lens
from evaluation.datasets.simulated import Simulated
from sim.recording.true_surface import TrueSurface
from sim.robots.motion import Robot

EVERY = 10
"""Every tenth image is chosen: three per second, as many as reconstruction from images needs."""
POINTS = 20_000
PIXEL_CENTRE = 0.5
"""Centre of the upper left pixel in COLMAP and Nerfstudio [px]."""
GREY = 128
"""Colour of points that no image shows."""
ON_SURFACE_M = 1e-4
"""Distance below which a point is on a surface: ten times the error of float32 [m]."""
NEAR = 1e-3
"""A ray that ends this share of its length before a point hit the point's own surface."""


@dataclass(frozen=True, eq=False)
class Seen:
    """Points in one image.

    Attributes:
        indices: (M,) indices of the points.
        pixels: (M, 2) pixels (x, y); integer coordinates are pixel centres.
    """

    indices: NDArray[np.int64]
    pixels: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class View:
    """One image with its true pose, its index among all images of its robot, and points in it."""

    robot: Robot
    index: int
    file: Path
    T_world_camera: SE3
    seen: Seen


@dataclass(frozen=True, eq=False)
class Views:
    """Images robot by robot, and true points in the colours of the first image that sees them."""

    views: list[View]
    cloud: PointCloud

    def times_seen(self) -> NDArray[np.int64]:
        """(N,) number of images that each point is in."""
        indices = [view.seen.indices for view in self.views]
        return np.bincount(np.concatenate(indices), minlength=len(self.cloud))


def choose_views(simulated: Simulated, robots: tuple[Robot, ...]) -> Views:
    """Every tenth image of each robot.

    Raises:
        InputError: A camera has a rolling shutter: its images have no single pose.
    """
    truth = simulated.truth
    for robot in robots:
        if truth.lens(robot).readout_s:
            raise InputError(
                f"{simulated.recording.path}: the {robot} camera has a rolling shutter; COLMAP and "
                "Nerfstudio know one pose an image"
            )
    sampled = truth.surface(robots[-1])
    cloud = sample_surface(sampled, POINTS)
    points = cloud.points.astype(np.float64)
    colours = cloud.colours.copy()
    coloured = np.zeros(len(points), bool)
    views = []
    for robot in robots:
        lens, surface = truth.lens(robot), truth.surface(robot)
        # In a world that changes, a robot may see no surface at a point of the other's.
        there = surface is sampled or surface.distance(points) < ON_SURFACE_M
        for index, stamp_ns in list(enumerate(simulated.stamps_ns(robot)))[::EVERY]:
            T_world_camera = truth.T_world_camera(robot, stamp_ns)
            seen = _seen_by(surface, lens, T_world_camera, points, there)
            new = ~coloured[seen.indices]
            if new.any():
                files = simulated.files
                pixels = files.mav(index) if robot == "mav" else files.ground(index)[0]
                colours[seen.indices[new]] = _colours_at(pixels, seen.pixels[new])
                coloured[seen.indices] = True
            file = simulated.image_files(robot)[index]
            views.append(View(robot, index, file, T_world_camera, seen))
    return Views(views, PointCloud(cloud.points, colours))


def sample_surface(surface: TrueSurface, count: int) -> PointCloud:
    """Points spread evenly over a true surface, in the world; the same in every call."""
    mesh = surface.mesh
    corners = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    rng = np.random.default_rng(0)
    chosen = corners[rng.choice(len(corners), count, p=areas / areas.sum())]
    # The square root spreads them evenly over a triangle.
    far, along = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    points = (
        (1 - far) * chosen[:, 0] + far * (1 - along) * chosen[:, 1] + far * along * chosen[:, 2]
    )
    return PointCloud(points.astype(np.float32), np.full((count, 3), GREY, np.uint8))


def _seen_by(
    surface: TrueSurface,
    lens: Lens,
    T_world_camera: SE3,
    points_world: NDArray,
    there: NDArray[np.bool_] | bool,
) -> Seen:
    """The points (N, 3) that are there, lie in the image and are not hidden by the surface."""
    pixels = lens.project(T_world_camera.inverse() @ points_world)
    x, y = pixels.T
    with np.errstate(invalid="ignore"):
        inside = (x > -0.5) & (x < lens.width - 0.5) & (y > -0.5) & (y < lens.height - 0.5)
    indices = np.flatnonzero(inside & there)
    origin = T_world_camera.translation
    rays = np.empty((len(indices), 6), np.float32)
    rays[:, :3], rays[:, 3:] = origin, points_world[indices] - origin
    hits = surface.scene.cast_rays(o3d.core.Tensor.from_numpy(rays))["t_hit"].numpy()
    clear = hits >= 1 - NEAR
    return Seen(indices[clear], pixels[indices[clear]])


def _colours_at(image: NDArray[np.uint8], pixels: NDArray[np.float64]) -> NDArray[np.uint8]:
    """(M, 3) RGB of the nearest pixels of a grey (H, W) or colour (H, W, 3) image."""
    x, y = np.rint(pixels).astype(int).T
    colours = image[y, x]
    return colours if colours.ndim == 2 else np.repeat(colours[:, None], 3, axis=1)
