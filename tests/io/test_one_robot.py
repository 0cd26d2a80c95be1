"""A recording of one robot alone: that robot is read, the other is refused in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from airground.core.cloud import Source
from airground.errors import RecordingError
from airground.io.header import read_header
from airground.io.open_recording import open_recording, open_robot
from airground.io.recording import Recording
from airground.io.recording_folder import RecordingFolder
from tests.io.recordings import images, write_recording

OTHER = {"mav": "ground", "ground": "mav"}
NAMES = {"mav": "MAV", "ground": "ground robot"}


@pytest.fixture(params=["mav", "ground"])
def robot(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture
def path(robot: str, tmp_path: Path) -> Path:
    return write_recording(tmp_path / "alone", (robot,))


def test_the_robot_that_is_there_is_read_as_in_a_recording_of_both(
    robot: str, path: Path, tmp_path: Path
) -> None:
    source = Source[robot.upper()]
    both = Recording.open(write_recording(tmp_path / "both")).of(source)
    alone = open_robot(path, source)
    np.testing.assert_array_equal(alone.camera_stamps, both.camera_stamps)
    np.testing.assert_array_equal(alone.imu.gyro, both.imu.gyro)
    grey, colour, _ = images(2)
    image = alone.read_image(2)
    if robot == "mav":
        np.testing.assert_array_equal(image.image, grey)
    else:
        np.testing.assert_array_equal(image.colour, colour)
        np.testing.assert_array_equal(image.depth, both.read_image(2).depth)


def test_its_header_states_no_image_of_the_other(robot: str, path: Path) -> None:
    header = read_header(path / "recording.toml")
    assert header.frames.robots() == (robot,)
    assert getattr(header.frames, OTHER[robot]) == 0
    assert header.facts().endswith(f"0.2 s, {NAMES[robot]} alone")
    assert {folder.name for folder in path.iterdir() if folder.is_dir()} == {
        {"mav": "mav0", "ground": "ground"}[robot]
    }


def test_the_other_robot_is_refused(robot: str, path: Path) -> None:
    other = OTHER[robot]
    wanted = f"holds the {NAMES[robot]}, not the {NAMES[other]}; expected .* --only {other}"
    with pytest.raises(RecordingError, match=f"{path}: {wanted}"):
        open_robot(path, Source[other.upper()])


def test_who_needs_both_robots_refuses_it(robot: str, path: Path) -> None:
    for opened in (Recording.open, open_recording):
        with pytest.raises(
            RecordingError, match=f"{path}: holds the {NAMES[robot]} alone; .* both"
        ):
            opened(path)


def test_two_of_them_make_a_pair(tmp_path: Path) -> None:
    paths = [write_recording(tmp_path / robot, (robot,)) for robot in ("mav", "ground")]
    pair, both = open_recording(*paths), Recording.open(write_recording(tmp_path / "both"))
    assert [type(one.message) for one in pair.messages()] == [
        type(one.message) for one in both.messages()
    ]


def test_digests_are_compared(path: Path) -> None:
    folder = RecordingFolder.open(path)
    folder.verify()
    first, second = sorted(path.rglob("*.png"))[:2]
    first.write_bytes(second.read_bytes())
    with pytest.raises(RecordingError, match="differs from what was recorded"):
        folder.verify()


def test_a_folder_of_the_other_contradicts_the_header(robot: str, path: Path) -> None:
    other = path / {"mav": "ground", "ground": "mav0"}[robot]
    other.mkdir()
    with pytest.raises(RecordingError, match=f"{other}: is there, .* says 0 images"):
        RecordingFolder.open(path)


def test_a_recording_of_no_robot_is_refused(robot: str, path: Path) -> None:
    header = path / "recording.toml"
    header.write_text(header.read_text().replace(f"{robot} = 4", f"{robot} = 0"))
    with pytest.raises(RecordingError, match="'frames': one robot at least must have images"):
        RecordingFolder.open(path)
