"""A showcase is read back as written, and its pictures show each thing at its place."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.errors import InputError
from evaluation.measure.baselines.matched_images import MatchedImages
from evaluation.measure.showcase import Showcase
from evaluation.show.figures.scene_pictures import (
    BACKGROUND,
    Viewpoint,
    aerial_viewpoint,
    render_augmented_map,
    robot_viewpoint,
)
from tests.evaluation.synthetic_results import make_showcase


@pytest.fixture(scope="module")
def showcase() -> Showcase:
    return make_showcase(scale=8)


def _same(one: object, two: object) -> bool:
    if dataclasses.is_dataclass(one):
        names = [member.name for member in dataclasses.fields(one)]
        return type(one) is type(two) and all(
            _same(getattr(one, name), getattr(two, name)) for name in names
        )
    if isinstance(one, tuple):
        return len(one) == len(two) and all(map(_same, one, two))  # type: ignore[arg-type]
    if isinstance(one, np.ndarray):
        return one.dtype == two.dtype and np.array_equal(one, two, equal_nan=one.dtype.kind == "f")  # type: ignore[attr-defined]
    return one == two


def test_a_showcase_is_read_back_as_written(showcase: Showcase, tmp_path: Path) -> None:
    showcase.save(tmp_path)
    assert _same(Showcase.load(tmp_path), showcase)


def test_matched_images_are_read_back_as_written(showcase: Showcase, tmp_path: Path) -> None:
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    pixels = np.array([[0.5, 1.0], [2.0, 1.5]])
    matched = MatchedImages(image, image, pixels, pixels, np.array([True, False]), 3, False)
    dataclasses.replace(showcase, matched=matched).save(tmp_path)
    assert _same(Showcase.load(tmp_path).matched, matched)


def test_the_refined_alignment_is_read_back_as_written(showcase: Showcase, tmp_path: Path) -> None:
    refined = SE3.from_heading(0.1)
    dataclasses.replace(showcase, T_ground_mav=refined).save(tmp_path)
    assert _same(Showcase.load(tmp_path).T_ground_mav, refined)


def test_nothing_is_pickled(showcase: Showcase, tmp_path: Path) -> None:
    showcase.save(tmp_path)
    with np.load(tmp_path / "showcase.npz", allow_pickle=False) as stored:
        assert all(stored[name].dtype != object for name in stored.files)


@pytest.mark.parametrize("name", ["showcase.npz", "ground.ply"])
def test_a_damaged_file_is_named(showcase: Showcase, tmp_path: Path, name: str) -> None:
    showcase.save(tmp_path)
    (tmp_path / name).write_bytes(b"rubbish")
    with pytest.raises(InputError, match=name):
        Showcase.load(tmp_path)


def test_a_missing_entry_is_named(showcase: Showcase, tmp_path: Path) -> None:
    showcase.save(tmp_path)
    with np.load(tmp_path / "showcase.npz") as stored:
        entries = {name: stored[name] for name in stored.files if name != "surface.camera.fx"}
    np.savez(tmp_path / "showcase.npz", **entries)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"entry 'surface\.camera\.fx' is missing"):
        Showcase.load(tmp_path)


def test_results_from_before_the_overlap_was_kept_are_read(
    showcase: Showcase, tmp_path: Path
) -> None:
    showcase.save(tmp_path)
    with np.load(tmp_path / "showcase.npz") as stored:
        entries = {name: stored[name] for name in stored.files if not name.endswith(".overlap")}
        assert len(entries) < len(stored.files)
    np.savez(tmp_path / "showcase.npz", **entries)  # type: ignore[arg-type]
    steps = Showcase.load(tmp_path).steps
    assert all(np.isnan(step.belief.overlap) for step in steps)


def test_a_cut_cloud_is_refused(showcase: Showcase, tmp_path: Path) -> None:
    showcase.save(tmp_path)
    path = tmp_path / "ground.ply"
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match=r"ground\.ply"):
        Showcase.load(tmp_path)


def test_a_viewpoint_looks_at_its_target() -> None:
    view = Viewpoint(np.array([1.0, -2.0, 3.0]), np.array([0.0, 1.0, 0.5]))
    pose = view.camera_pose()
    np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    in_camera = pose[:3, :3].T @ (view.target - view.eye)
    np.testing.assert_allclose(in_camera[:2], 0, atol=1e-12)
    assert in_camera[2] < 0


def test_the_aerial_view_holds_both_paths(showcase: Showcase) -> None:
    view = aerial_viewpoint(showcase)
    pose = view.camera_pose()
    paths = np.concatenate([showcase.mav_path.translations, showcase.ground_path.translations])
    in_camera = (paths - view.eye) @ pose[:3, :3]
    half = np.tan(np.radians(26))
    assert (in_camera[:, 2] < 0).all()
    assert (np.abs(in_camera[:, 1]) <= half * -in_camera[:, 2]).all()
    assert (np.abs(in_camera[:, 0]) <= 1.5 * half * -in_camera[:, 2]).all()


def test_ground_points_are_red_and_aerial_points_grey() -> None:
    """One patch of each source, seen from above: known colours at known places."""
    made = make_showcase(scale=8)
    side = np.linspace(-0.4, 0.4, 60)
    patch = np.stack([*(g.ravel() for g in np.meshgrid(side, side)), np.zeros(3600)], axis=1)
    aside = np.array([0.6, 0, 0])
    colours = np.full((3600, 3), 140, np.uint8)
    shown = dataclasses.replace(
        made,
        ground_cloud=PointCloud((patch - aside).astype(np.float32), colours),
        aerial_cloud=PointCloud((patch + aside).astype(np.float32), colours),
    )
    view = Viewpoint(np.array([0.0, 0.0, 2.0]), np.zeros(3))
    picture = render_augmented_map(shown, view, (300, 200)).astype(int)
    assert picture.shape == (200, 300, 3)
    red, grey = picture[100, 90], picture[100, 210]
    assert red[0] > 2 * red[1]
    assert np.ptp(grey) <= 3
    assert grey[0] == pytest.approx(140, abs=6)
    np.testing.assert_allclose(picture[3, 3], BACKGROUND, atol=2)


def test_the_robots_view_is_from_behind_the_robot(showcase: Showcase) -> None:
    view = robot_viewpoint(showcase)
    robot = showcase.ground_path[len(showcase.ground_path) // 2].translation
    centre = np.median(showcase.aerial_cloud.points, axis=0)
    assert np.linalg.norm(view.eye[:2] - centre[:2]) > np.linalg.norm(robot[:2] - centre[:2])
    assert view.eye[2] > robot[2]


@pytest.mark.parametrize("kept", [0, 100, 5000])
def test_a_file_that_is_cut_is_named(showcase: Showcase, tmp_path: Path, kept: int) -> None:
    showcase.save(tmp_path)
    file = tmp_path / "showcase.npz"
    file.write_bytes(file.read_bytes()[:kept])
    with pytest.raises(InputError, match=r"showcase\.npz: no readable showcase"):
        Showcase.load(tmp_path)
