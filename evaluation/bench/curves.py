"""How the stages' times grow: one size is varied at a time, all others are fixed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike

from airground.core.cloud import PointCloud
from airground.dense.view_selection import PosedImage
from airground.dense.volume import resized
from evaluation.bench.dense_rows import Sweep, VoxelWork, sweep_of
from evaluation.bench.localization_rows import Maps, paper_sized, particles, refinement
from evaluation.bench.material import Material
from evaluation.bench.work import Work


@dataclass(frozen=True)
class Curve:
    """One size that is varied: title of the timed stage, and parameter with its unit."""

    name: str
    title: str
    parameter: str
    values: tuple[float, ...]
    make: Callable[[Material, float], Work]


class CurvePoint(NamedTuple):
    """A curve at one of its values."""

    curve: str
    value: float


def exponent(values: ArrayLike, times_ms: ArrayLike) -> float:
    """Exponent p of the law time = a value^p, fitted on logarithmic axes."""
    return float(np.polyfit(np.log(np.asarray(values)), np.log(np.asarray(times_ms)), 1)[0])


def _image_width(material: Material, width_px: float) -> Work:
    """Add a frame, from smaller images."""
    sweep = sweep_of(material, material.config)
    height_px = round(width_px * sweep.camera.height / sweep.camera.width)
    size = round(width_px), height_px

    def shrunk(view: PosedImage) -> PosedImage:
        image = cv2.resize(view.image, size, interpolation=cv2.INTER_AREA)
        return replace(view, image=image.astype(np.uint8))

    views = [shrunk(view) for view in sweep.views]
    small = Sweep(
        resized(sweep.camera, *size),
        shrunk(sweep.reference),
        views,
        sweep.config,
        sweep.depth_range,
    )
    return Work(small.add_next, small.make_ready)


def _hypotheses(material: Material, planes: float) -> Work:
    config = material.config
    parameters = config.plane_sweep.model_copy(update={"hypotheses": round(planes)})
    sweep = sweep_of(material, config.model_copy(update={"plane_sweep": parameters}))
    return Work(sweep.add_next, sweep.make_ready)


def _voxels(material: Material, millions: float) -> Work:
    config = material.config
    full = config.fusion.voxels
    scale = float(np.cbrt(millions * 1e6 / np.prod(full)))
    voxels = tuple(max(8, round(scale * n)) for n in full)
    parameters = config.fusion.model_copy(update={"voxels": voxels})
    work = VoxelWork(material.depth_maps, config.model_copy(update={"fusion": parameters}))
    return Work(work.all_of_it)


def _search_area(material: Material, area_m2: float) -> Work:
    return Work(Maps(material, paper_sized(search_radius_m=float(np.sqrt(area_m2)) / 2)).search)


def _cells_per_m(material: Material, cells_per_m: float) -> Work:
    config = paper_sized()
    height_maps = config.height_maps.model_copy(update={"cells_per_m": cells_per_m})
    config = config.model_copy(update={"height_maps": height_maps})
    return Work(Maps(material, config).search)


def _particles(material: Material, count: float) -> Work:
    return particles(material, round(count))


def _map_size(material: Material, copies: float) -> Work:
    return refinement(material, tiled(material.ground_cloud, round(copies)))


def tiled(cloud: PointCloud, copies: int) -> PointCloud:
    """A larger map: copies of one beside each other along x."""
    points = cloud.points
    step = np.array([np.ptp(points[:, 0]) + 1.0, 0.0, 0.0], np.float32)
    return PointCloud(
        np.concatenate([points + copy * step for copy in range(copies)]),
        np.tile(cloud.colours, (copies, 1)),
    )


CURVES = (
    Curve(
        "image_width",
        "Add a frame",
        "width of the image [px]",
        (188, 266, 376, 532, 752),
        _image_width,
    ),
    Curve("hypotheses", "Add a frame", "depth hypotheses", (25, 50, 100, 200, 400), _hypotheses),
    Curve("voxels", "A fused surface", "voxels [millions]", (1.7, 3.4, 6.8, 13.5, 27), _voxels),
    Curve("search_area", "Full cost map", "searched area [m²]", (5, 10, 20, 40, 80), _search_area),
    Curve(
        "cells_per_m", "Full cost map", "cells per metre", (12.5, 17.5, 25, 35, 50), _cells_per_m
    ),
    Curve(
        "particles", "Weigh and draw particles", "particles", (50, 100, 200, 400, 800), _particles
    ),
    Curve("map_size", "Local search and ICP", "size of the map [times]", (1, 2, 4, 8), _map_size),
)
CURVES_BY_NAME = {curve.name: curve for curve in CURVES}
