"""What was written is what is read, in order; damage is an error of one line."""

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from airground.core.cloud import Source
from airground.core.messages import (
    USUAL_BIAS_MPS2,
    CalibrationSigmas,
    GroundImage,
    ImuSamples,
    MagneticSamples,
    MavImage,
)
from airground.errors import RecordingError
from airground.io import layout
from airground.io.euroc import read_imu, write_imu
from airground.io.recording import Recording
from tests.io.recordings import (
    GROUND_STAMPS,
    MAV_STAMPS,
    UNITS_PER_M,
    calibration,
    images,
    imu_samples,
    magnetic_samples,
    write_recording,
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return write_recording(tmp_path / "recording")


def test_everything_comes_back_as_written(path: Path) -> None:
    recording = Recording.open(path)
    recording.verify()
    assert (recording.scene, recording.seed, recording.flight) == ("indoor_a", 7, 1)
    assert recording.header.calibration == calibration()
    assert (recording.mav.camera_stamps == MAV_STAMPS).all()
    assert (recording.ground.camera_stamps == GROUND_STAMPS).all()
    np.testing.assert_array_equal(recording.ground.imu.gyro, imu_samples().gyro)
    np.testing.assert_array_equal(recording.mav.imu.accelerometer, imu_samples().accelerometer)
    np.testing.assert_array_equal(recording.mav.magnetic.field, magnetic_samples().field)
    for index in range(len(MAV_STAMPS)):
        mav, ground = recording.mav.read_image(index), recording.ground.read_image(index)
        grey, colour, units = images(index)
        np.testing.assert_array_equal(mav.image, grey)
        np.testing.assert_array_equal(ground.colour, colour)
        expected = np.where(units == 0, np.nan, units / UNITS_PER_M)
        np.testing.assert_allclose(ground.depth, expected, rtol=1e-6)


def test_a_header_need_not_state_how_well_the_calibration_is_known(path: Path) -> None:
    header = path / layout.HEADER
    assert "sigma" not in header.read_text()
    assert Recording.open(path).ground.calibration.sigmas == CalibrationSigmas()
    text = header.read_text().replace(
        "[calibration.ground.depth]\n", "[calibration.ground.depth]\nscale_sigma = 0.01\n"
    )
    header.write_text(text)
    assert Recording.open(path).ground.calibration.sigmas == CalibrationSigmas(depth_scale=0.01)
    header.write_text(text.replace("scale_sigma = 0.01", "scale_sigma = -0.01"))
    with pytest.raises(RecordingError, match="scale_sigma"):
        Recording.open(path)


@pytest.mark.parametrize(
    ("density", "stated", "known"),
    [(1e-3, None, USUAL_BIAS_MPS2), (1e-2, None, 0.25), (1e-3, 0.03, 0.03), (1e-2, 0.03, 0.03)],
)
def test_the_bias_of_an_accelerometer_is_as_stated_or_as_usual(
    path: Path, density: float, stated: float | None, known: float
) -> None:
    header = path / layout.HEADER
    lines = f"accelerometer_noise_density = {density}\n"
    if stated is not None:
        lines += f"accelerometer_bias_sigma = {stated}\n"
    text, count = re.subn(r"accelerometer_noise_density = .*\n", lines, header.read_text())
    assert count == 2
    header.write_text(text)
    recording = Recording.open(path)
    for robot in (recording.mav, recording.ground):
        assert robot.calibration.accelerometer_bias_sigma == pytest.approx(known)


def test_without_an_imu_a_bias_is_as_usual(path: Path) -> None:
    calibration = replace(Recording.open(path).mav.calibration, imu=None)
    assert calibration.accelerometer_bias_sigma == USUAL_BIAS_MPS2


def test_messages_come_in_order_of_time_and_samples_before_their_image(path: Path) -> None:
    recording = Recording.open(path)
    newest = {Source.MAV: -1, Source.GROUND: -1}
    seen: dict[tuple[Source, type], list[int]] = {}
    image_stamps = []
    for stamped in recording.messages():
        message = stamped.message
        stamps = np.atleast_1d(
            message.stamp_ns if isinstance(message, MavImage | GroundImage) else message.stamps_ns
        )
        if isinstance(message, MavImage | GroundImage):
            image_stamps.append(message.stamp_ns)
            # Nothing that was measured before this image is still to come.
            newest[stamped.robot] = message.stamp_ns
        else:
            assert stamps[0] > newest[stamped.robot]
        seen.setdefault((stamped.robot, type(message)), []).extend(stamps.tolist())
    assert image_stamps == sorted(image_stamps)
    assert len(image_stamps) == 8
    for robot, last in ((Source.MAV, MAV_STAMPS[-1]), (Source.GROUND, GROUND_STAMPS[-1])):
        expected = [t for t in imu_samples().stamps_ns.tolist() if t <= last]
        assert seen[robot, ImuSamples] == expected
        assert seen[robot, MagneticSamples] == expected


def test_an_image_is_found_by_its_stamp(path: Path) -> None:
    recording = Recording.open(path)
    np.testing.assert_array_equal(recording.mav.image_at(83_333_333).image, images(1)[0])
    np.testing.assert_array_equal(recording.ground.image_at(155_000_000).colour, images(3)[1])
    with pytest.raises(ValueError, match="83333334"):
        recording.mav.image_at(83_333_334)


def test_the_truth_is_never_opened(path: Path) -> None:
    (path / "truth").mkdir(mode=0o000)
    try:
        recording = Recording.open(path)
        assert sum(1 for _ in recording.messages()) > 0
        recording.verify()
    finally:
        (path / "truth").chmod(0o755)
    assert not any("truth" in name for name in recording.header.digests)


def edit(file: Path, old: str, new: str) -> None:
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))


def flip_gravity(file: Path) -> None:
    samples = read_imu(file)
    write_imu(file, ImuSamples(samples.stamps_ns, samples.gyro, -samples.accelerometer))


def in_microseconds(file: Path) -> None:
    samples = read_imu(file)
    write_imu(file, ImuSamples(samples.stamps_ns // 1000, samples.gyro, samples.accelerometer))


def keep_lines(file: Path, count: int) -> None:
    file.write_text("\n".join(file.read_text().splitlines()[:count]) + "\n")


IMAGE = f"{layout.MAV_IMAGES}/83333333.png"
SECOND_ROW = "5000000,"
BROKEN = {
    "no header": (lambda p: (p / "recording.toml").unlink(), "recording.toml"),
    "other schema": (lambda p: edit(p / "recording.toml", "schema = 1", "schema = 9"), "reads 1"),
    "unknown key": (
        lambda p: edit(p / "recording.toml", "seed =", "sed = 1\nseed ="),
        "unknown key 'sed'",
    ),
    "negative focal length": (
        lambda p: edit(p / "recording.toml", "fx = 20.0", "fx = -20.0"),
        r"calibration\.mav\.camera\.fx.*greater than or equal to 1",
    ),
    "principal point outside": (
        lambda p: edit(p / "recording.toml", "cx = 11.5", "cx = 40.0"),
        "lies outside the 24x16 image",
    ),
    "no rotation": (
        lambda p: edit(p / "recording.toml", "0.9553364891256", "0.9953364891256"),
        r"T_body_imu.*must be a rotation",
    ),
    "missing image": (lambda p: (p / IMAGE).unlink(), "83333333.png: .*missing"),
    "missing list": (lambda p: (p / layout.MAV_CAMERA_LIST).unlink(), "data.csv: .*missing"),
    "twice": (
        lambda p: edit(p / layout.MAV_CAMERA_LIST, "83333333,", "50000000,"),
        "stamp 50000000 .*twice",
    ),
    "out of order": (
        lambda p: edit(p / layout.GROUND_ASSOCIATIONS, "0.155000000", "0.010000000"),
        "stamp 10000000 .*strictly increase",
    ),
    "no stamp": (
        lambda p: edit(p / layout.MAV_CAMERA_LIST, "83333333,", "soon,"),
        r"data\.csv:3",
    ),
    "NaN": (
        lambda p: (p / layout.MAV_IMU_DATA).write_text("#\n0,1,1,1,1,1,1\n5,1,nan,1,1,1,1\n"),
        "sample at stamp 5 is not finite",
    ),
    "short row": (
        lambda p: (p / layout.GROUND_IMU_DATA).write_text("#\n0,1,1,1,1,1,1\n5,1,1\n"),
        "6 numbers a line",
    ),
    "gravity of the wrong sign": (
        lambda p: flip_gravity(p / layout.MAV_IMU_DATA),
        r"mav0/imu0/data\.csv: gravity has the wrong sign",
    ),
    "IMU that ends early": (
        lambda p: keep_lines(p / layout.GROUND_IMU_DATA, 20),
        r"ground/imu0/data\.csv: the IMU does not cover the images: it ends 0\.065 s before",
    ),
    "IMU stamps in microseconds": (
        lambda p: in_microseconds(p / layout.MAV_IMU_DATA),
        r"mav0/imu0/data\.csv: .* they look like microseconds; expected nanoseconds",
    ),
    "unequal count": (
        lambda p: edit(p / "recording.toml", "mav = 4", "mav = 5"),
        "lists 4 images, recording.toml says 5",
    ),
    "wrong calibration size": (
        lambda p: edit(p / "recording.toml", "width = 24", "width = 25"),
        "is 24x16, the calibration says 25x16",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_damage_is_reported_when_opening(path: Path, name: str) -> None:
    damage, pattern = BROKEN[name]
    damage(path)
    with pytest.raises(RecordingError) as caught:
        Recording.open(path)
    message = str(caught.value)
    assert "\n" not in message
    assert re.search(pattern, message), message


def truncate(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-20])


def flip_a_byte(file: Path) -> None:
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0xFF
    file.write_bytes(bytes(data))


@pytest.mark.parametrize(
    ("damage", "pattern"),
    [
        (truncate, "truncated"),
        (flip_a_byte, "cannot be decoded"),
        (lambda file: file.write_bytes(b"GIF89a"), "no PNG"),
        (lambda file: cv2.imwrite(str(file), np.zeros((16, 24, 3), np.uint8)), "3 channels"),
        (lambda file: cv2.imwrite(str(file), np.zeros((16, 20), np.uint8)), "20x16"),
    ],
)
def test_a_damaged_image_is_reported_when_streaming(path: Path, damage, pattern: str) -> None:
    recording = Recording.open(path)
    damage(path / IMAGE)
    with pytest.raises(RecordingError, match=pattern) as caught:
        list(recording.messages())
    assert "83333333.png" in str(caught.value)
    with pytest.raises(RecordingError, match=layout.MAV_IMAGES):
        recording.verify()


def test_verify_finds_a_changed_number(path: Path) -> None:
    edit(path / layout.GROUND_MAGNETOMETER_DATA, "5000000,", "5000001,")
    recording = Recording.open(path)
    with pytest.raises(RecordingError, match=r"mag0/data\.csv"):
        recording.verify()


def test_no_recording_at_all(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no such recording"):
        Recording.open(tmp_path / "nothing")
