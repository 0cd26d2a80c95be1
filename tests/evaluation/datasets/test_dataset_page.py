"""The page of a dataset: its statistics against closed forms, and that it stands alone."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from airground.core.camera import PinholeCamera
from airground.core.cloud import Source
from airground.core.se3 import SE3
from airground.io.open_recording import open_robot
from evaluation.datasets.gallery.figures import highest
from evaluation.datasets.gallery.overlap import CELL_M, share_inside, shares
from evaluation.datasets.gallery.statistics import look_at, motion
from tests.evaluation.datasets.test_inspect import airground

CAMERA = PinholeCamera(100, 80, 100.0, 100.0, 49.5, 39.5)


def test_a_camera_that_moved_by_a_quarter_of_its_image_shares_three_quarters() -> None:
    depth = np.full((80, 100), 2.0)
    points = CAMERA.back_project(depth).reshape(-1, 3)
    moved = SE3(np.eye(3), np.array([0.25 * 100 * 2.0 / 100.0, 0, 0]))
    assert share_inside(points, CAMERA, SE3.identity()) == 1.0
    assert share_inside(points, CAMERA, moved) == pytest.approx(0.75)
    assert np.isnan(share_inside(np.zeros((0, 3)), CAMERA, moved))


def test_views_share_what_lies_in_a_cell_or_beside_it() -> None:
    other = np.array([[0.05, 0.05, 0.05], [-7.0, 3.0, 1.0]])
    step = np.array([CELL_M, 0, 0])
    beside, beyond = other[:1] + step, other[:1] + 2 * step
    views = [other, np.concatenate([beside, beyond]), beyond]
    np.testing.assert_array_equal(shares(views, other), [1.0, 0.5, 0.0])


def test_motion_is_that_of_a_circle_and_rest_does_not_count() -> None:
    stamps = np.arange(91, dtype=np.int64) * 33_333_333
    turn = np.maximum(stamps / 1e9 - 1.0, 0)  # at rest for a second, then 1 rad/s at 2 m
    poses: list[SE3 | None] = [
        SE3.from_heading(angle, (2 * np.cos(angle), 2 * np.sin(angle), 0)) for angle in turn
    ]
    speed, turning = motion(stamps, poses)
    assert 18 <= len(speed) <= 20
    assert np.median(speed) == pytest.approx(2.0, rel=1e-3)
    assert np.median(turning) == pytest.approx(np.rad2deg(1.0), rel=1e-3)


def test_a_place_from_above_is_as_high_as_its_highest_point() -> None:
    points = np.array([[0.01, 0.01, 1.0], [0.02, 0.03, 2.0], [0.01, 0.12, -1.0]])
    heights, borders = highest(points)
    np.testing.assert_array_equal(heights, [[2.0, np.nan, -1.0]])
    np.testing.assert_allclose(borders, [0, 0.05, 0, 0.15], atol=1e-12)


def test_robots_of_a_recording_in_numbers(small: Path) -> None:
    mav, ground = (look_at(open_robot(small, robot)) for robot in (Source.MAV, Source.GROUND))
    assert (mav.robot, mav.images, len(mav.samples)) == ("mav", 21, 12)
    assert mav.samples[0].depth is None
    assert ground.samples[0].depth is not None
    assert 0.05 < mav.path_m < 2
    assert 10 < mav.mean_grey.mean() < 245
    assert mav.dark.shape == (12,)


def test_a_folder_of_recordings_makes_a_page_that_stands_alone(
    small: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(small, tmp_path / "data" / "ours")
    shutil.copytree(small / "mav0", tmp_path / "data" / "field" / "first" / "mav0")
    page = tmp_path / "page.html"
    assert airground("inspect", tmp_path / "data", "--page", page) == 0
    assert "field/first mav" in " ".join(capsys.readouterr().out.split())
    text = page.read_text(encoding="utf-8")
    sources = re.findall(r'(?:src|href)="([^"]{1,30})', text)
    assert [one for one in sources if not one.startswith(("data:image/webp;", "#"))] == []
    for name in ("ours", "field/first", "From above", "Overlap with the ground robot"):
        assert name in text
    assert text.count("There is no truth, hence no path.") == 1
    assert airground("inspect", tmp_path / "data", "--page", page) == 2
    assert "exists already; name a new file" in capsys.readouterr().err


def test_a_page_that_cannot_be_written_leaves_nothing(
    small: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "nowhere" / "page.html"
    assert airground("inspect", small, "--page", page) == 2
    assert "there is no folder" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
