"""TUM RGB-D folders as others write them: JPEG, millimetres, one list, frame numbers, any rate."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from airground.core.cloud import Source
from airground.core.messages import GroundImage
from airground.errors import RecordingError
from airground.io.open_recording import open_robot
from airground.io.robot_recording import RobotRecording
from airground.io.tum import parse_stamp
from tests.io.plain_folders import TUM_COLOUR_S, TUM_DEPTH_S, write_tum

FULL_SIZE = """resolution: [640, 480]
intrinsics: [500.0, 500.0, 320.0, 240.0]
distortion_model: none
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_tum(tmp_path / "rgbd_dataset_freiburg1_xyz")


def ground(folder: Path) -> RobotRecording:
    return open_robot(folder, Source.GROUND)


def rewrite(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def as_jpeg(folder: Path) -> None:
    """Colour becomes JPEG, in files and list."""
    for file in sorted((folder / "rgb").iterdir()):
        cv2.imwrite(str(file.with_suffix(".jpg")), cv2.imread(str(file)))
        file.unlink()
    rewrite(folder / "rgb.txt", ".png", ".jpg")


def test_colour_may_be_jpeg(folder: Path) -> None:
    before = ground(folder).read_image(2)
    as_jpeg(folder)
    frame = ground(folder).read_image(2)
    assert isinstance(frame, GroundImage)
    assert isinstance(before, GroundImage)
    assert np.abs(frame.colour.astype(int) - before.colour).max() <= 3
    np.testing.assert_array_equal(frame.depth, before.depth)


JPEG_DAMAGE: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "truncated": (lambda data: data[:-300], "cannot be decoded: the JPEG image is damaged"),
    "header": (lambda data: data[:20], "cannot be decoded: the JPEG image is damaged"),
    "huge": (
        lambda data: data.replace(struct.pack(">HH", 480, 640), struct.pack(">HH", 60000, 60000)),
        "is 60000x60000, the calibration says 640x480",
    ),
    "no image": (lambda data: b"GIF89a" + data, "is no PNG or JPEG image"),
}


@pytest.mark.parametrize("what", JPEG_DAMAGE)
def test_damaged_jpegs_are_named_in_one_line(folder: Path, what: str) -> None:
    as_jpeg(folder)
    damage, message = JPEG_DAMAGE[what]
    file = sorted((folder / "rgb").iterdir())[0]
    file.write_bytes(damage(file.read_bytes()))
    with pytest.raises(RecordingError, match=message) as raised:
        ground(folder)
    assert file.name in str(raised.value)
    assert "\n" not in str(raised.value)


def scaled(folder: Path, factor: float) -> None:
    for file in (folder / "depth").iterdir():
        depth = cv2.imread(str(file), cv2.IMREAD_UNCHANGED)
        cv2.imwrite(str(file), np.rint(depth * factor).astype(np.uint16))


def test_millimetres_are_read_where_they_are_stated(folder: Path) -> None:
    scaled(folder, 1 / 5)
    frame = open_robot(folder, Source.GROUND, depth_units_per_m=1000).read_image(0)
    assert isinstance(frame, GroundImage)
    assert np.nanmedian(frame.depth) == pytest.approx(1.5)
    (folder / "sensor.yaml").write_text(FULL_SIZE + "depth_units_per_m: 1000\n")
    frame = ground(folder).read_image(0)
    assert isinstance(frame, GroundImage)
    assert np.nanmedian(frame.depth) == pytest.approx(1.5)
    assert ground(folder).assumed == ()


def test_a_scale_that_was_guessed_wrong_is_an_error(folder: Path) -> None:
    assert ground(folder).assumed == ("depth: 5000 per metre, usual for its format",)
    scaled(folder, 1 / 5)
    message = (
        r"depth: the median depth is 0\.30 m at 5000 per metre; it looks like 1000 per metre; "
        r"give --depth-scale 1000, or 5000 if that is right"
    )
    with pytest.raises(RecordingError, match=message):
        ground(folder)
    stated = open_robot(folder, Source.GROUND, depth_units_per_m=5000)
    assert np.nanmedian(stated.read_image(0).depth) == pytest.approx(0.3)


def in_one_list(folder: Path, line: str) -> None:
    """`associations.txt` in place of the two lists."""
    rows = [
        line.format(c=c, d=d, n=n)
        for n, (c, d) in enumerate(zip(TUM_COLOUR_S, TUM_DEPTH_S, strict=True), start=2)
    ]
    (folder / "associations.txt").write_text("\n".join(rows) + "\n")
    for name in ("rgb.txt", "depth.txt"):
        (folder / name).unlink()


COLOUR_FIRST = "{c} rgb/{c}.png {d} depth/{d}.png"
DEPTH_FIRST = "{d} depth/{d}.png {c} rgb/{c}.png"


@pytest.mark.parametrize("line", [COLOUR_FIRST, DEPTH_FIRST])
def test_associations_alone_are_enough(folder: Path, line: str) -> None:
    before = [ground(folder).read_image(index) for index in range(4)]
    in_one_list(folder, line)
    recording = ground(folder)
    assert recording.camera_stamps.tolist() == [parse_stamp(s) for s in TUM_COLOUR_S]
    for index, frame in enumerate(before):
        now = recording.read_image(index)
        np.testing.assert_array_equal(now.colour, frame.colour)
        np.testing.assert_array_equal(now.depth, frame.depth)


@pytest.mark.parametrize("rate_hz", [10, 30, 60])
def test_frame_numbers_become_stamps(folder: Path, rate_hz: int) -> None:
    """As in ICL-NUIM, whose lists count images."""
    in_one_list(folder, "{n} depth/{d}.png {n} rgb/{c}.png")
    assert "stamps: frame numbers at 30 Hz" in ground(folder).assumed
    (folder / "sensor.yaml").write_text(FULL_SIZE + f"rate_hz: {rate_hz}\n")
    recording = ground(folder)
    expected = [round(n * 1e9 / rate_hz) for n in (2, 3, 4, 5)]
    assert recording.camera_stamps.tolist() == expected
    published = recording.published_stamps(recording.camera_stamps)
    assert published.tolist() == [n * 10**9 for n in (2, 3, 4, 5)]


@pytest.mark.parametrize("rate_hz", [10, 20, 30, 60])
def test_any_usual_rate_is_read(tmp_path: Path, rate_hz: int) -> None:
    """Depth 4 ms after colour is paired at every rate."""
    folder = write_tum(tmp_path / "fr3_rates")
    for name, stamps, late in (("rgb.txt", TUM_COLOUR_S, 0), ("depth.txt", TUM_DEPTH_S, 0.004)):
        lines = [
            f"{100 + index / rate_hz + late:.6f} {name[:-4]}/{stamp}.png"
            for index, stamp in enumerate(stamps)
        ]
        (folder / name).write_text("\n".join(lines) + "\n")
    recording = ground(folder)
    assert len(recording.camera_stamps) == 4
    assert np.median(np.diff(recording.camera_stamps)) == pytest.approx(1e9 / rate_hz, abs=2000)
