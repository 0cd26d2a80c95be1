"""`transforms.json` holds the true poses of the images, in the axes of Nerfstudio."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import open3d as o3d
import pytest

from evaluation.datasets.formats import FORMATS
from evaluation.datasets.simulated import Simulated


@pytest.fixture(scope="module")
def folder(exported: Callable[[str], Path]) -> Path:
    return exported("nerfstudio")


@pytest.fixture(scope="module")
def content(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "transforms.json").read_text())


def test_every_file_is_there(folder: Path, content: dict[str, Any]) -> None:
    named = {frame[key] for frame in content["frames"] for key in ("file_path", "depth_file_path")}
    assert named == {str(p.relative_to(folder)) for p in folder.rglob("*.png")}
    assert len(content["frames"]) == 3
    assert (content["w"], content["h"]) == (640, 480)


def world_points(content: dict[str, Any], frame: dict[str, Any], depth: np.ndarray) -> np.ndarray:
    """As Nerfstudio has it: rays through x + 0.5, along -z with y up; depth along the axis."""
    y, x = np.nonzero(depth)
    z = depth[y, x] / 1000.0
    right = (x + 0.5 - content["cx"]) / content["fl_x"] * z
    up = -(y + 0.5 - content["cy"]) / content["fl_y"] * z
    c2w = np.array(frame["transform_matrix"])
    return np.stack([right, up, -z], axis=1) @ c2w[:3, :3].T + c2w[:3, 3]


def test_depth_lands_on_the_true_surface(
    folder: Path, content: dict[str, Any], simulated: Simulated
) -> None:
    for frame in content["frames"]:
        depth = cv2.imread(str(folder / frame["depth_file_path"]), cv2.IMREAD_UNCHANGED)
        assert depth.dtype == np.uint16
        near = np.where(depth < 2500, depth, 0)
        points = world_points(content, frame, near)[::50]
        assert len(points) > 500
        assert np.median(simulated.truth.surface("mav").distance(points)) < 0.01


def test_points_to_begin_with_are_on_the_surface_and_coloured(
    folder: Path, simulated: Simulated
) -> None:
    cloud = o3d.io.read_point_cloud(str(folder / "points.ply"))
    assert simulated.truth.surface("mav").distance(np.asarray(cloud.points)).max() < 1e-5
    assert np.asarray(cloud.colors).std() > 0.04


def test_the_mav_has_no_depth(tmp_path: Path, simulated: Simulated) -> None:
    FORMATS["nerfstudio"].write(tmp_path, simulated, ("mav",))
    frames = json.loads((tmp_path / "transforms.json").read_text())["frames"]
    assert all("depth_file_path" not in frame for frame in frames)
    assert not (tmp_path / "depths").exists()
