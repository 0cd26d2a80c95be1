"""A COLMAP model in text form, of true poses and true points (colmap.github.io/format).
The centre of the upper left pixel is at (0.5, 0.5). Poses map the world to the camera."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np

from evaluation.datasets.simulated import Simulated, copy_images
from evaluation.datasets.views import PIXEL_CENTRE, View, Views, choose_views
from sim.robots.motion import ROBOTS, Robot

POINT_DECIMALS, PIXEL_DECIMALS = 6, 4
"""Of points [m] and pixels."""
MIN_VIEWS = 2
"""Images that a track needs at least."""
OPENCV_COEFFICIENTS, FULL_OPENCV_COEFFICIENTS = 4, 8
"""Numbers of distortion coefficients of COLMAP's models, in OpenCV's order."""


def write_colmap_folder(folder: Path, simulated: Simulated, robots: tuple[Robot, ...]) -> None:
    """Fill an empty folder with images and a sparse model."""
    views = choose_views(simulated, robots)
    for robot in robots:
        files = [view.file for view in views.views if view.robot == robot]
        copy_images(files, folder / "images" / robot)
    model = folder / "sparse" / "0"
    model.mkdir(parents=True)
    _write(model / "cameras.txt", [_camera_line(simulated, robot) for robot in robots])
    kept = views.times_seen() >= MIN_VIEWS
    tracks: dict[int, list[str]] = defaultdict(list)
    lines = []
    for image_id, view in enumerate(views.views, start=1):
        shown = kept[view.seen.indices]
        points = view.seen.indices[shown].tolist()
        lines += [_image_line(image_id, view), _pixels_line(view, shown)]
        for position, point in enumerate(points):
            tracks[point].append(f"{image_id} {position}")
    _write(model / "images.txt", lines)
    _write(model / "points3D.txt", _point_lines(views, tracks, _errors_px(simulated, views)))


def _camera_line(simulated: Simulated, robot: Robot) -> str:
    lens = simulated.truth.lens(robot)
    fx, fy, cx, cy = lens.intrinsics
    model, distortion = "PINHOLE", lens.distortion
    if lens.model == "equidistant":
        model = "OPENCV_FISHEYE"
    elif lens.bends:
        model = "OPENCV" if len(distortion) == OPENCV_COEFFICIENTS else "FULL_OPENCV"
        distortion += (0.0,) * (FULL_OPENCV_COEFFICIENTS - len(distortion)) * (model != "OPENCV")
    numbers = fx, fy, cx + PIXEL_CENTRE, cy + PIXEL_CENTRE, *distortion
    words = " ".join(map(repr, numbers))
    return f"{_camera_id(robot)} {model} {lens.width} {lens.height} {words}"


def _camera_id(robot: Robot) -> int:
    return ROBOTS.index(robot) + 1


def _image_line(image_id: int, view: View) -> str:
    T_camera_world = view.T_world_camera.inverse()
    x, y, z, w = T_camera_world.quaternion_xyzw().tolist()
    numbers = [w, x, y, z, *T_camera_world.translation.tolist()]
    pose = " ".join(map(repr, numbers))
    return f"{image_id} {pose} {_camera_id(view.robot)} {view.robot}/{view.file.name}"


def _pixels_line(view: View, shown: np.ndarray) -> str:
    pixels = (view.seen.pixels[shown] + PIXEL_CENTRE).tolist()
    points = view.seen.indices[shown].tolist()
    return " ".join(
        f"{x:.{PIXEL_DECIMALS}f} {y:.{PIXEL_DECIMALS}f} {_point_id(point)}"
        for (x, y), point in zip(pixels, points, strict=True)
    )


def _errors_px(simulated: Simulated, views: Views) -> np.ndarray:
    """(N,) mean distance of each point's pixels from where its images show it, both as written:
    what rounding leaves of true points and poses [px]; NaN for points in no image."""
    sums, counts = np.zeros(len(views.cloud)), np.zeros(len(views.cloud))
    points_world = np.round(views.cloud.points.astype(np.float64), POINT_DECIMALS)
    for view in views.views:
        seen, T_camera_world = view.seen, view.T_world_camera.inverse()
        lens = simulated.truth.lens(view.robot)
        pixels = lens.project(T_camera_world @ points_world[seen.indices])
        off = np.round(seen.pixels + PIXEL_CENTRE, PIXEL_DECIMALS) - PIXEL_CENTRE - pixels
        sums[seen.indices] += np.linalg.norm(off, axis=1)
        counts[seen.indices] += 1
    with np.errstate(invalid="ignore"):
        return np.asarray(sums / counts)


def _point_lines(views: Views, tracks: dict[int, list[str]], errors_px: np.ndarray) -> list[str]:
    """Ascending by the point's number."""
    lines = []
    for point in sorted(tracks):
        place = " ".join(
            f"{value:.{POINT_DECIMALS}f}" for value in views.cloud.points[point].tolist()
        )
        colour = " ".join(map(str, views.cloud.colours[point].tolist()))
        error = f"{errors_px[point]:.6f}"
        lines.append(f"{_point_id(point)} {place} {colour} {error} {' '.join(tracks[point])}")
    return lines


def _point_id(point: int) -> int:
    return point + 1


def _write(path: Path, lines: list[str]) -> None:
    path.write_text("\n".join([f"# {path.stem} of the truth, by airground", *lines]) + "\n")
