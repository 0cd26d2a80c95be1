"""One robot's images for Nerfstudio and other readers of its `transforms.json`.
Poses are in OpenGL's axes: the camera looks along -z with y up. Pixel centres are at halves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.io.lens import Lens
from airground.io.ply import write_ply
from evaluation.datasets.simulated import Simulated, copy_images
from evaluation.datasets.views import PIXEL_CENTRE, View, choose_views
from sim.robots.motion import Robot

MM_PER_M = 1000.0
RADTAN_KEYS = ("k1", "k2", "p1", "p2", "k3")
FISHEYE_KEYS = ("k1", "k2", "k3", "k4")
"""Keys of the distortion, in OpenCV's order of the coefficients."""
T_CAMERA_OPENGL = SE3(np.diag([1.0, -1.0, -1.0]), np.zeros(3))


def write_nerfstudio_folder(folder: Path, simulated: Simulated, robots: tuple[Robot, ...]) -> None:
    """Fill an empty folder with one robot's images and their poses."""
    (robot,) = robots
    views = choose_views(simulated, robots)
    copy_images([view.file for view in views.views], folder / "images")
    frames = [_frame(view) for view in views.views]
    if robot == "ground":
        (folder / "depths").mkdir()
        for frame, view in zip(frames, views.views, strict=True):
            frame["depth_file_path"] = f"depths/{view.file.name}"
            _write_depth(folder / frame["depth_file_path"], simulated, view)
    seen = views.times_seen() > 0
    write_ply(
        folder / "points.ply", PointCloud(views.cloud.points[seen], views.cloud.colours[seen])
    )
    content = {
        **_intrinsics(simulated.truth.lens(robot)),
        "ply_file_path": "points.ply",
        "frames": frames,
    }
    text = json.dumps(content, indent=1) + "\n"
    (folder / "transforms.json").write_text(text, encoding="utf-8")


def _intrinsics(lens: Lens) -> dict[str, Any]:
    """OPENCV, which all readers of this file know, or OPENCV_FISHEYE."""
    fx, fy, cx, cy = lens.intrinsics
    fisheye = lens.model == "equidistant"
    names = FISHEYE_KEYS if fisheye else RADTAN_KEYS
    return {
        "camera_model": "OPENCV_FISHEYE" if fisheye else "OPENCV",
        "w": lens.width,
        "h": lens.height,
        "fl_x": fx,
        "fl_y": fy,
        "cx": cx + PIXEL_CENTRE,
        "cy": cy + PIXEL_CENTRE,
        **dict.fromkeys(names[:4], 0.0),
        **dict(zip(names, lens.distortion, strict=False)),
    }


def _frame(view: View) -> dict[str, Any]:
    T_world_opengl = view.T_world_camera @ T_CAMERA_OPENGL
    return {
        "file_path": f"images/{view.file.name}",
        "transform_matrix": T_world_opengl.matrix().tolist(),
    }


def _write_depth(path: Path, simulated: Simulated, view: View) -> None:
    _, depth = simulated.files.ground(view.index)
    depth_mm = np.nan_to_num(depth) * MM_PER_M
    if not cv2.imwrite(str(path), np.rint(depth_mm).astype(np.uint16)):
        raise OSError(f"{path}: cannot be written")
