"""Folders in the form of 7-Scenes: numbered frames, no lists, no stamps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.errors import InputError, RecordingError
from airground.io.open_recording import layout_of, open_robot

FRAMES = 4
WIDTH, HEIGHT = 640, 480


def write_seven_scenes(root: Path, suffix: str = "png") -> Path:
    """Frames 7 to 10 of a wall 2 m away, with a hole and a pixel without depth."""
    root.mkdir()
    for number in range(7, 7 + FRAMES):
        name = root / f"frame-{number:06d}"
        colour = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
        colour[:] = (10 * number, 100, 200)  # blue, green, red
        cv2.imwrite(f"{name}.color.{suffix}", colour)
        depth = np.full((HEIGHT, WIDTH), 2000 + number, np.uint16)
        depth[:100], depth[100:150] = 0, 65535
        cv2.imwrite(f"{name}.depth.png", depth)
    return root


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_seven_scenes(tmp_path / "seq-01")


@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_frames_are_read_in_order(tmp_path: Path, suffix: str) -> None:
    folder = write_seven_scenes(tmp_path / "seq-01", suffix)
    assert layout_of(folder) == "7scenes"
    recording = open_robot(folder, Source.GROUND)
    assert recording.camera_stamps.tolist() == [round(n * 1e9 / 30) for n in range(7, 11)]
    camera = recording.calibration.camera
    assert (camera.width, camera.height, camera.fx, camera.cx) == (WIDTH, HEIGHT, 585.0, 320.0)
    frame = recording.read_image(2)
    assert isinstance(frame, GroundImage)
    assert np.abs(frame.colour[300, 300].astype(int) - (200, 100, 90)).max() <= 2
    assert np.isnan(frame.depth[:150]).all()
    np.testing.assert_allclose(frame.depth[150:], 2.009, rtol=1e-6)
    assert len(recording.assumed) == 3


def test_taken_for_the_mavs_it_is_grey(folder: Path) -> None:
    image = open_robot(folder, Source.MAV).read_image(0)
    assert isinstance(image, MavImage)


def test_a_copys_matrix_and_a_calibrations_rate_are_used(folder: Path, tmp_path: Path) -> None:
    (folder / "camera-intrinsics.txt").write_text("520.0 0 321\n0 521.0 242\n0 0 1\n")
    assert open_robot(folder, Source.GROUND).calibration.camera.fy == 521.0
    file = tmp_path / "mine.yaml"
    file.write_text(
        "resolution: [640, 480]\nintrinsics: [500, 501, 320, 240]\ndistortion_model: none\n"
        "rate_hz: 20\ndepth_units_per_m: 1000\n"
    )
    recording = open_robot(folder, Source.GROUND, file)
    assert recording.calibration.camera.fx == 500.0
    assert recording.camera_stamps[0] == 350_000_000
    assert recording.assumed == ()


def remove_depth(folder: Path) -> None:
    for file in folder.glob("*.depth.png"):
        file.unlink()


BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "no depth": (remove_depth, r"seq-01: no frame has colour and depth; expected frame-000000\.c"),
    "twice": (
        lambda f: (f / "frame-000008.color.jpg").write_bytes(b"\xff\xd8\xff"),
        "frame 8 is there twice",
    ),
    "matrix": (
        lambda f: (f / "camera-intrinsics.txt").write_text("585 0 320\n0 585 240\n"),
        r"camera-intrinsics\.txt: expected three rows of three numbers",
    ),
    "other size": (
        lambda f: cv2.imwrite(
            str(f / "frame-000007.depth.png"), np.full((240, 320), 2000, np.uint16)
        ),
        r"frame-000007\.depth\.png: depth is 320x240, its colour image is 640x480",
    ),
    "no image": (
        lambda f: (f / "frame-000007.color.png").write_bytes(b"text"),
        r"frame-000007\.color\.png: is no PNG or JPEG image",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_folders_are_named_in_one_line(folder: Path, what: str) -> None:
    damage, message = BAD[what]
    damage(folder)
    with pytest.raises(RecordingError, match=message) as raised:
        open_robot(folder, Source.GROUND)
    assert "\n" not in str(raised.value)


def test_frames_without_depth_are_left_out(folder: Path) -> None:
    (folder / "frame-000008.depth.png").unlink()
    assert len(open_robot(folder, Source.GROUND).camera_stamps) == FRAMES - 1


def test_the_folder_above_names_the_one_to_give(folder: Path) -> None:
    message = r"holds no recording; expected .*; seq-01 in it is one \(7scenes\)"
    with pytest.raises(RecordingError, match=message):
        open_robot(folder.parent, Source.GROUND)


OPTIONS = {
    "--depth-scale": ({"depth_units_per_m": 1000.0}, "has no depth images"),
    "--topics": ({"topics": {"image": "/a"}}, "is no ROS bag"),
}


@pytest.mark.parametrize("word", OPTIONS)
def test_options_without_a_use_are_refused(tmp_path: Path, word: str) -> None:
    (tmp_path / "mav0" / "cam0").mkdir(parents=True)
    given, message = OPTIONS[word]
    with pytest.raises(InputError, match=f"{word}: .*{message}"):
        open_robot(tmp_path, Source.MAV, **given)  # type: ignore[arg-type]
