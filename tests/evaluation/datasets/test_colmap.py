"""pycolmap opens the COLMAP export, and its cameras see the true points where they are."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

from evaluation.datasets.colmap import PIXEL_CENTRE
from evaluation.datasets.simulated import Simulated

pycolmap = pytest.importorskip("pycolmap", reason="pycolmap is not installed")
VIEWS = 3
"""Of 21 images every tenth."""


@pytest.fixture(scope="module")
def folder(exported: Callable[[str], Path]) -> Path:
    return exported("colmap")


@pytest.fixture(scope="module")
def model(folder: Path):
    return pycolmap.Reconstruction(folder / "sparse" / "0")


def test_every_image_is_there_and_posed(folder: Path, model) -> None:
    names = {str(p.relative_to(folder / "images")) for p in folder.rglob("*.png")}
    assert {image.name for image in model.images.values()} == names
    assert len(names) == model.num_reg_images() == 2 * VIEWS
    assert {name.split("/")[0] for name in names} == {"mav", "ground"}
    assert all(camera.model.name == "PINHOLE" for camera in model.cameras.values())


def test_true_points_are_reprojected_within_half_a_pixel(model) -> None:
    errors = []
    for image in model.images.values():
        for point2d in image.get_observation_points2D():
            pixel = image.project_point(model.points3D[point2d.point3D_id].xyz)
            errors.append(np.linalg.norm(pixel - point2d.xy))
    assert len(errors) > 5000
    assert max(errors) < 0.5


def test_tracks_and_images_say_the_same(model) -> None:
    tracks = {
        (element.image_id, element.point2D_idx): point_id
        for point_id, point in model.points3D.items()
        for element in point.track.elements
    }
    seen = {
        (image_id, index): point2d.point3D_id
        for image_id, image in model.images.items()
        for index, point2d in enumerate(image.points2D)
    }
    assert tracks == seen
    assert min(point.track.length() for point in model.points3D.values()) == 2


def test_rays_through_the_pixels_meet_the_points(model, simulated: Simulated) -> None:
    """In our convention of pixels, poses and cameras, not in that of the export."""
    for image in model.images.values():
        robot, name = image.name.split("/")
        files = [file.name for file in simulated.image_files(robot)]
        stamp = simulated.stamps_ns(robot)[files.index(name)]
        T, camera = (
            simulated.truth.T_world_camera(robot, stamp),
            simulated.truth.lens(robot).pinhole(),
        )
        observed = image.get_observation_points2D()
        x, y = (np.array([p.xy for p in observed]) - PIXEL_CENTRE).T
        ahead = np.stack(
            [(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, np.ones(len(x))]
        )
        origins = np.broadcast_to(T.translation, (len(x), 3))
        rays = np.hstack([origins, (T.rotation @ ahead).T]).astype(np.float32)
        hits = simulated.truth.surface("ground").scene.cast_rays(o3d.core.Tensor.from_numpy(rays))[
            "t_hit"
        ]
        points = np.array([model.points3D[p.point3D_id].xyz for p in observed])
        off = np.linalg.norm(origins + hits.numpy()[:, None] * rays[:, 3:] - points, axis=1)
        assert np.median(off) < 2e-4
        assert np.quantile(off, 0.99) < 5e-3  # a ray may just miss an edge


def test_points_have_the_colours_of_an_image(model) -> None:
    colours = np.array([point.color for point in model.points3D.values()])
    assert colours.std() > 10
