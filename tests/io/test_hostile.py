"""Recordings made to do harm are refused with one clear line, whatever they try."""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

from airground.core.cloud import Source
from airground.errors import AirgroundError
from airground.io.images import decode, read_depth, read_grey
from airground.io.open_recording import open_robot
from airground.io.ply import read_ply
from airground.io.recording import Recording
from airground.io.sensor_file import read_imu_noise, read_mapping
from sim.recording.true_surface import TrueSurface
from tests.io.plain_folders import write_euroc, write_tum
from tests.io.recordings import write_recording


def edit(path: Path, pattern: str, by: str) -> None:
    text, count = re.subn(pattern, lambda _: by, path.read_text(), count=1)
    assert count == 1
    path.write_text(text)


def refused(action: Callable[[], object], pattern: str) -> None:
    with pytest.raises(AirgroundError) as caught:
        action()
    message = str(caught.value)
    assert re.search(pattern, message), message
    assert "\n" not in message
    assert len(message) < 1000


LED = "(leads out of the recording|has a zero byte)"
OUTSIDE = ["../../../../etc/secret.png", "/etc/secret.png", "a/../../b.png", "a\0b.png"]


@pytest.mark.parametrize("name", OUTSIDE)
def test_names_that_lead_elsewhere(tmp_path: Path, name: str) -> None:
    ours = write_recording(tmp_path / "ours")
    edit(ours / "mav0/cam0/data.csv", r"83333333\.png", name)
    refused(lambda: Recording.open(ours), rf"mav0/cam0/data\.csv: .* {LED}")
    ours = write_recording(tmp_path / "ground")
    edit(ours / "ground/associations.txt", r"depth/\S+", name)
    refused(lambda: Recording.open(ours), rf"associations\.txt: .* {LED}")
    euroc = write_euroc(tmp_path / "euroc")
    edit(euroc / "mav0/cam0/data.csv", r"(?<=,)\d+\.png", name)
    refused(lambda: open_robot(euroc, Source.MAV), rf"cam0/data\.csv: .* {LED}")
    tum = write_tum(tmp_path / "rgbd_dataset_freiburg1_xyz")
    edit(tum / "rgb.txt", r"rgb/\S+png", name)
    refused(lambda: open_robot(tum, Source.GROUND), rf"rgb\.txt: .* {LED}")


@pytest.mark.parametrize("name", ["../../etc/secret", "/etc/secret"])
def test_digests_of_files_elsewhere(tmp_path: Path, name: str) -> None:
    ours = write_recording(tmp_path / "ours")
    edit(ours / "recording.toml", '"ground/rgb"', f'"{name}"')
    recording = Recording.open(ours)
    refused(recording.verify, r"recording\.toml: .* leads out of the recording")


def png_that_claims(width: int, height: int) -> bytes:
    """A whole PNG file of few bytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    size = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    pixels = zlib.compress(bytes(1000))
    start = b"\x89PNG\r\n\x1a\n"
    return start + chunk(b"IHDR", size) + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


@pytest.mark.parametrize("size", [(2**31 - 1, 2**31 - 1), (60_000, 60_000), (0, 0), (24, 2**30)])
def test_images_that_claim_to_be_huge(tmp_path: Path, size: tuple[int, int]) -> None:
    """They are not decoded: OpenCV would raise, or fill the memory."""
    ours = write_recording(tmp_path / "ours")
    recording = Recording.open(ours)
    image = ours / "mav0/cam0/data/83333333.png"
    image.write_bytes(png_that_claims(*size))
    refused(lambda: recording.mav.read_image(1), rf"83333333\.png: is {size[0]}x{size[1]}")
    refused(lambda: read_depth(image, 24, 16, 5000.0), "the calibration says 24x16")


def test_an_image_with_fewer_pixels_than_it_claims(tmp_path: Path) -> None:
    image = tmp_path / "a.png"
    image.write_bytes(png_that_claims(640, 480))
    refused(lambda: read_grey(image, 640, 480), "cannot be decoded")


@pytest.mark.parametrize("side", [10**6, 2**40])
def test_calibrations_that_claim_huge_images(tmp_path: Path, side: int) -> None:
    euroc = write_euroc(tmp_path / "euroc")
    edit(euroc / "mav0/cam0/sensor.yaml", r"\[64, 48\]", f"[{side}, {side}]")
    refused(lambda: open_robot(euroc, Source.MAV), "'resolution': .* is more than 8192 pixels")
    ours = write_recording(tmp_path / "ours")
    edit(ours / "recording.toml", "width = 24", f"width = {side}")
    refused(lambda: Recording.open(ours), r"camera\.width.*less than or equal to 8192")


YAML = {
    "tag that calls": ("!!python/object/apply:os.system ['true']", "cannot be read.*constructor"),
    "tag that makes": ("!!python/object:subprocess.Popen {}", "cannot be read.*constructor"),
    "tag of a name": ("a: !!python/name:os.system", "cannot be read.*constructor"),
    "aliases": ("a: &a [1, 1]\nb: &b [*a, *a]\nc: [*b, *b]", "aliases are not read"),
    "merged aliases": ("a: &a {x: 1}\nb: {<<: [*a, *a]}", "aliases are not read"),
    "depth": ("[" * 100_000, "cannot be read: its brackets are nested too deep"),
    "no table": ("- 1\n- 2", "expected 'key: value' lines"),
    "several documents": ("a: 1\n---\nb: 2", "cannot be read"),
    "impossible date": ("a: 2021-99-99", "cannot be read"),
    "zero bytes": ("a: \0", "cannot be read"),
    "no integer": ('a: 1\nb: !!int ""', r"'' is no int \(line 2\)"),
    "no truth value": ("a: !!bool maybe", r"'maybe' is no bool \(line 1\)"),
    "no time": ("a: !!timestamp noon", r"'noon' is no timestamp \(line 1\)"),
    "no number": ("a: [!!float x]", r"'x' is no float \(line 1\)"),
}


@pytest.mark.parametrize("what", YAML)
def test_yaml_that_is_more_than_numbers(tmp_path: Path, what: str) -> None:
    text, pattern = YAML[what]
    file = tmp_path / "sensor.yaml"
    file.write_text(text)
    refused(lambda: read_mapping(file), pattern)


def test_a_number_beyond_all_floats(tmp_path: Path) -> None:
    file = tmp_path / "imu.yaml"
    file.write_text(f"gyroscope_noise_density: {'9' * 400}")
    refused(lambda: read_imu_noise(file), "expected a positive number, got 999")


def test_an_image_of_more_pixels_than_any_camera_has() -> None:
    header = b"".join(n.to_bytes(4, "big") for n in (30_000, 30_000)) + bytes([16, 0, 0, 0, 0])
    chunk = b"IHDR" + header
    end = b"\0\0\0\0IEND\xaeB`\x82"
    size, check = len(header).to_bytes(4, "big"), zlib.crc32(chunk).to_bytes(4, "big")
    with pytest.raises(ValueError, match="30000x30000 are more than 67108864 pixels"):
        decode(b"\x89PNG\r\n\x1a\n" + size + chunk + check + end)


@pytest.mark.parametrize(
    ("vertex", "index", "pattern"),
    [
        (0.0, 2, None),
        (np.nan, 2, "a vertex is not finite"),
        (0.0, 3, "a triangle has a vertex that is not there"),
    ],
)
def test_a_true_mesh_without_meaning(
    tmp_path: Path, vertex: float, index: int, pattern: str | None
) -> None:
    file = tmp_path / "surface.ply"
    vertices = o3d.utility.Vector3dVector(np.array([[0, 0, vertex], [1, 0, 0], [0, 1, 0]]))
    triangles = o3d.utility.Vector3iVector(np.array([[0, 1, index]]))
    mesh = o3d.geometry.TriangleMesh(vertices, triangles)
    assert o3d.io.write_triangle_mesh(str(file), mesh)
    surface = TrueSurface(file, tmp_path / "parts.csv")
    if pattern is None:
        assert len(surface.mesh.triangles) == 1
    else:
        refused(lambda: surface.mesh, pattern)


def test_toml_that_is_nested_too_deep(tmp_path: Path) -> None:
    ours = write_recording(tmp_path / "ours")
    edit(ours / "recording.toml", r"(?m)^seed = .*$", f"seed = {'[' * 100_000}")
    refused(lambda: Recording.open(ours), "nested too deep")
    (tmp_path / "a.toml").write_text(f"a = {'[' * 100_000}")
    refused(lambda: read_mapping(tmp_path / "a.toml"), "nested too deep")


@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e999"])
def test_calibrations_that_are_no_numbers(tmp_path: Path, number: str) -> None:
    ours = write_recording(tmp_path / "ours")
    edit(ours / "recording.toml", "fx = 20.0", f"fx = {number}")
    refused(lambda: Recording.open(ours), r"calibration\.mav\.camera\.fx")
    ours = write_recording(tmp_path / "pose")
    edit(ours / "recording.toml", "0.95533648912560", f"{number}, #")
    refused(lambda: Recording.open(ours), r"recording\.toml")
    yaml = {"nan": ".nan", "inf": ".inf", "-inf": "-.inf"}.get(number, number)
    for key, pattern in (
        ("intrinsics", r"39\.03"),
        ("distortion_coefficients", r"-0\.28340811"),
        ("T_BS", r"0\.0148655429818"),
    ):
        euroc = write_euroc(tmp_path / key)
        edit(euroc / "mav0/cam0/sensor.yaml", pattern, yaml)
        refused(lambda folder=euroc: open_robot(folder, Source.MAV), f"key '{key}'")


@pytest.mark.parametrize("stamp", ["99999999999999999999", "9" * 5000, "-9" * 30, "1e300"])
def test_stamps_that_no_clock_shows(tmp_path: Path, stamp: str) -> None:
    for place in ("mav0/cam0/data.csv", "mav0/imu0/data.csv"):
        euroc = write_euroc(tmp_path / place.split("/")[1])
        edit(euroc / place, r"(?m)^\d+(?=,)", stamp)
        refused(lambda folder=euroc: open_robot(folder, Source.MAV), r"data\.csv")
    tum = write_tum(tmp_path / "rgbd_dataset_freiburg1_xyz")
    edit(tum / "depth.txt", r"(?m)^\d+\.\d+", stamp)
    refused(lambda: open_robot(tum, Source.GROUND), r"depth\.txt:4")


PLY_HEADERS = {
    "too many points": "element vertex 999999999999999999999999",
    "endless number": "element vertex " + "9" * 5000,
    "the same column twice": "element vertex 1\nproperty float x\nproperty float x",
    "more than there is": "element vertex 4000000000\nproperty float x\nproperty float y\n"
    "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue",
}


@pytest.mark.parametrize("what", PLY_HEADERS)
def test_clouds_that_claim_more_than_they_hold(tmp_path: Path, what: str) -> None:
    file = tmp_path / "a.ply"
    header = f"ply\nformat binary_little_endian 1.0\n{PLY_HEADERS[what]}\nend_header\n"
    file.write_bytes(header.encode() + bytes(15))
    refused(lambda: read_ply(file), r"a\.ply: (cannot read the PLY header line|is truncated)")


def test_samples_that_no_imu_measures(tmp_path: Path) -> None:
    ours = write_recording(tmp_path / "ours")
    data = ours / "mav0/imu0/data.csv"
    first, sample, *rest = data.read_text().splitlines()
    stamp, *values = sample.split(",")
    for at, said in ((0, "gyro reads 1e\\+300 rad/s"), (5, "accelerometer reads 1e\\+300 m/s")):
        wrong = [*values[:at], "1e300", *values[at + 1 :]]
        data.write_text("\n".join([first, ",".join([stamp, *wrong]), *rest]) + "\n")
        refused(lambda: Recording.open(ours), rf"imu0/data\.csv: the {said}.* at stamp {stamp}")


@pytest.mark.parametrize("shift_s", [100.0, -0.06])
def test_stamps_beyond_the_recording(tmp_path: Path, shift_s: float) -> None:
    ours = write_recording(tmp_path / "ours")
    for name in ("cam0/data.csv", "imu0/data.csv", "mag0/data.csv"):
        path = ours / "mav0" / name
        first, *rest = path.read_text().splitlines()
        moved = [
            f"{int(line.partition(',')[0]) + round(shift_s * 1e9)},{line.partition(',')[2]}"
            for line in rest
        ]
        path.write_text("\n".join([first, *moved]) + "\n")
    refused(lambda: Recording.open(ours), r"cam0/data\.csv: images from .* expected from 0 to 0\.2")
