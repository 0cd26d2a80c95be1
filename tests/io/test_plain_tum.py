"""Plain TUM RGB-D folders: what is read, and every complaint that a damaged one deserves."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.errors import RecordingError
from airground.io.open_recording import open_robot
from airground.io.robot_recording import RobotRecording
from airground.io.tum import parse_stamp
from airground.io.tum_lists import associate
from tests.io.plain_folders import TUM_COLOUR_S, tum_image, write_tum

REAL = Path(__file__).parents[3] / "shared" / "real" / "tum_fr1_rpy_head"

CALIBRATION = """resolution: [320, 240]
intrinsics: [260.0, 261.0, 160.0, 120.0]
distortion_model: radtan
distortion_coefficients: [0, 0, 0, 0]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_tum(tmp_path / "rgbd_dataset_freiburg1_xyz")


def ground(folder: Path, calibration: Path | None = None) -> RobotRecording:
    return open_robot(folder, Source.GROUND, calibration)


def test_colour_and_depth_are_paired_by_their_stamps(folder: Path) -> None:
    recording = ground(folder)
    messages = [stamped.message for stamped in recording.messages()]
    assert all(isinstance(message, GroundImage) for message in messages)
    assert [m.stamp_ns for m in messages] == [parse_stamp(s) for s in TUM_COLOUR_S]  # type: ignore[union-attr]
    first = messages[1]
    assert isinstance(first, GroundImage)
    np.testing.assert_array_equal(first.colour[240, 320], [200, 100, 10])
    assert recording.imu is None
    assert recording.calibration.imu is None


def test_depth_is_in_metres_with_holes_where_the_file_has_zero(folder: Path) -> None:
    frame = ground(folder).read_image(0)
    assert isinstance(frame, GroundImage)
    holes = np.isnan(frame.depth)
    assert 0.02 < holes.mean() < 0.05
    assert (frame.depth[~holes] == 1.5).all()


def test_depth_and_colour_are_undistorted_alike(folder: Path) -> None:
    """The published lens bends; a disc in both images stays the same disc."""
    disc = np.zeros((480, 640), np.uint8)
    cv2.circle(disc, (500, 120), 40, 255, -1)
    for kind, image in (("rgb", cv2.merge([disc] * 3)), ("depth", np.uint16(disc) * 20)):
        file = sorted((folder / kind).iterdir())[0]
        cv2.imwrite(str(file), image)
    frame = ground(folder).read_image(0)
    assert isinstance(frame, GroundImage)
    bright, near = frame.colour[..., 0] > 127, np.isfinite(frame.depth)
    assert near.sum() > 1000
    assert (bright != near).sum() < 0.06 * near.sum()


@pytest.mark.parametrize(
    ("name", "fx"), [("fr1_desk", 517.3), ("rgbd_dataset_freiburg2_xyz", 520.9), ("fr3", 535.4)]
)
def test_the_published_calibration_is_chosen_by_name(tmp_path: Path, name: str, fx: float) -> None:
    camera = ground(write_tum(tmp_path / name)).calibration.camera
    assert (camera.width, camera.height) == (640, 480)
    # Undistortion rescales a little; a lens without distortion keeps the published numbers.
    assert camera.fx == pytest.approx(fx, rel=0.0 if name == "fr3" else 0.1)


@pytest.mark.parametrize(("name", "known"), [("fr1_desk", True), ("fr3", False)])
def test_a_kinect_takes_its_rows_one_after_the_other(
    tmp_path: Path, name: str, known: bool
) -> None:
    calibration = ground(write_tum(tmp_path / name)).calibration
    # Undistortion stretches the image: fewer rows of the camera fill it.
    stretched = calibration.camera.fy / 516.5
    assert calibration.readout_s == pytest.approx(0.02611 / stretched if known else 0.0)


@pytest.mark.parametrize(
    ("stated", "seconds"), [("0.02", 0.02), ("26.1", "is longer than 0.1 s"), ("-1", "positive")]
)
def test_a_calibration_states_the_readout_time(
    folder: Path, stated: str, seconds: float | str
) -> None:
    text = "resolution: [640, 480]\nintrinsics: [525, 525, 319.5, 239.5]\n"
    text += f"distortion_model: none\nreadout_s: {stated}\n"
    (folder / "calibration.yaml").write_text(text)
    if isinstance(seconds, float):
        assert ground(folder).calibration.readout_s == seconds
    else:
        with pytest.raises(RecordingError, match=f"readout_s.*{seconds}"):
            ground(folder)


def test_or_by_a_comment_in_the_lists(folder: Path, tmp_path: Path) -> None:
    renamed = folder.rename(tmp_path / "head")
    with pytest.raises(RecordingError, match="calibration is missing"):
        ground(renamed)
    lines = (renamed / "depth.txt").read_text()
    (renamed / "depth.txt").write_text(lines.replace("recording.bag", "x_freiburg3_sit.bag"))
    assert ground(renamed).calibration.camera.fx == 535.4


@pytest.mark.parametrize("beside", [True, False])
def test_a_calibration_file_serves_any_camera(tmp_path: Path, beside: bool) -> None:
    folder = write_tum(tmp_path / "mine", size=(320, 240))
    file = (folder if beside else tmp_path) / "sensor.yaml"
    file.write_text(CALIBRATION)
    recording = ground(folder, None if beside else file)
    assert recording.calibration.camera.fy == 261.0
    frame = recording.read_image(2)
    assert isinstance(frame, GroundImage)
    np.testing.assert_array_equal(frame.colour[..., ::-1], tum_image("rgb", 2, 320, 240))


def test_the_accelerometer_says_what_is_up(folder: Path) -> None:
    """A Kinect's counts left and up positive."""
    lines = ["# timestamp ax ay az"]
    for i in range(100):
        lines.append(f"{parse_stamp(TUM_COLOUR_S[0]) / 1e9 - 0.5 + 0.01 * i:.6f} 0.0 8.5 -4.9")
    (folder / "accelerometer.txt").write_text("\n".join(lines) + "\n")
    calibration = ground(folder).calibration
    T_body_camera = calibration.T_body_imu @ calibration.T_imu_camera
    up = T_body_camera.rotation.T @ np.array([0, 0, 1.0])
    np.testing.assert_allclose(up, [0, -0.8664, -0.4994], atol=1e-3)
    assert T_body_camera.rotation[0, 2] > 0.8


def rewrite(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def swap_lines(file: Path) -> None:
    lines = file.read_text().splitlines()
    lines[3], lines[4] = lines[4], lines[3]
    file.write_text("\n".join(lines) + "\n")


def in_unit(file: Path, factor: int) -> None:
    lines = file.read_text().splitlines()
    changed = lines[:3]
    for line in lines[3:]:
        stamp, name = line.split()
        changed.append(f"{parse_stamp(stamp) * factor // 10**9} {name}")
    file.write_text("\n".join(changed) + "\n")


def shrink_depth(folder: Path) -> None:
    file = sorted((folder / "depth").iterdir())[0]
    cv2.imwrite(str(file), tum_image("depth", 0, 320, 240))


def shift_depth(folder: Path) -> None:
    for stamp in ("165407", "201330", "233738", "265886"):
        rewrite(folder / "depth.txt", f"1305031102.{stamp} ", f"1305031105.{stamp} ")


BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "depth of another size": (
        shrink_depth,
        r"depth/.*\.png: depth is 320x240, its colour image is 640x480",
    ),
    "nanoseconds": (
        lambda f: in_unit(f / "rgb.txt", 10**9),
        r"rgb\.txt:4: the time '1305031102175304000' looks like nanoseconds; expected seconds",
    ),
    "microseconds": (
        lambda f: in_unit(f / "depth.txt", 10**6),
        r"depth\.txt:4: the time '1305031102165407' looks like microseconds; expected seconds",
    ),
    "unsorted": (
        lambda f: swap_lines(f / "rgb.txt"),
        r"rgb\.txt: stamp 1305031102175304000 \(entry 2\) follows 1305031102211214000",
    ),
    "other clock": (shift_depth, r"depth\.txt: no depth image is within 20 ms"),
    "image missing": (
        lambda f: sorted((f / "depth").iterdir())[1].unlink(),
        r"depth/1305031102\.201330\.png: this image is listed but missing",
    ),
    "no depth list": (lambda f: (f / "depth.txt").unlink(), r"depth\.txt: this file is missing"),
    "grey colour": (
        lambda f: cv2.imwrite(
            str(sorted((f / "rgb").iterdir())[0]), np.zeros((480, 640), np.uint8)
        ),
        r"rgb/.*\.png: has 1 channels of uint8, expected 3",
    ),
    "model": (
        lambda f: (f / "sensor.yaml").write_text(CALIBRATION.replace("radtan", "mei")),
        r"sensor\.yaml: key 'distortion_model': 'mei' is unknown",
    ),
    "accelerometer": (
        lambda f: (f / "accelerometer.txt").write_text("1305031102.1 0 9.81\n"),
        r"accelerometer\.txt:1: expected 'timestamp ax ay az'",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_input_is_named_in_one_line(folder: Path, what: str) -> None:
    damage, message = BAD[what]
    damage(folder)
    with pytest.raises(RecordingError, match=message) as raised:
        ground(folder)
    assert "\n" not in str(raised.value)


def test_without_calibration_it_says_how_to_give_one(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"--calibration FILE.*calibration\.yaml"):
        ground(write_tum(tmp_path / "kitchen"))


def test_taken_for_the_mavs_it_is_grey(folder: Path) -> None:
    recording = open_robot(folder, Source.MAV)
    image = recording.read_image(1)
    assert isinstance(image, MavImage)
    assert abs(int(image.image[240, 320]) - round(0.299 * 200 + 0.587 * 100 + 0.114 * 10)) <= 1
    assert {stamped.robot for stamped in recording.messages()} == {Source.MAV}


def naive_pairs(first: list[int], second: list[int], limit: int) -> list[tuple[int, int]]:
    near = [
        (abs(a - b), i, j)
        for i, a in enumerate(first)
        for j, b in enumerate(second)
        if abs(a - b) <= limit
    ]
    pairs: list[tuple[int, int]] = []
    for _, i, j in sorted(near):
        if all(i != a and j != b for a, b in pairs):
            pairs.append((i, j))
    return sorted(pairs)


STAMPS = st.lists(st.integers(0, 300), max_size=20, unique=True).map(sorted)


@given(STAMPS, STAMPS, st.integers(0, 30))
def test_pairs_are_the_nearest_first(first: list[int], second: list[int], limit: int) -> None:
    i, j = associate(np.array(first, np.int64), np.array(second, np.int64), limit)
    assert list(zip(i.tolist(), j.tolist(), strict=True)) == naive_pairs(first, second, limit)


@pytest.mark.skipif(not REAL.exists(), reason="the real recording tum_fr1_rpy_head is absent")
def test_a_real_recording_is_read() -> None:
    recording = ground(REAL)
    assert len(recording.camera_stamps) == 110
    assert recording.duration_s == pytest.approx(3.633, abs=1e-3)
    frame = recording.read_image(109)
    assert isinstance(frame, GroundImage)
    assert 0.5 < np.isfinite(frame.depth).mean() < 1.0
    # What the motion-capture system says is up: (0.505, -0.672, -0.542) in the camera.
    calibration = recording.calibration
    T_body_camera = calibration.T_body_imu @ calibration.T_imu_camera
    up = T_body_camera.rotation.T @ np.array([0, 0, 1.0])
    assert np.degrees(np.arccos(up @ np.array([0.505, -0.672, -0.542]))) < 6
