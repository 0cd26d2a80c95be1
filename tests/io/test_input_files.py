"""What is no file, or far too large, is refused before it is read."""

from __future__ import annotations

import os
import re
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from airground.errors import AirgroundError, InputError
from airground.io.header import read_toml
from airground.io.images import read_grey
from airground.io.input_files import (
    SETTINGS_LIMIT,
    TEXT_LIMIT,
    check_file,
    read_bytes,
    read_text,
)
from airground.io.input_limits import INPUT_LIMITS
from airground.io.ply import read_ply
from airground.io.recording import Recording
from airground.io.sensor_file import read_mapping
from evaluation.setup.settings import resolve
from evaluation.table.rows import ResultTable
from sim.geometry.parts import read_parts
from sim.robots.motion import Motion
from sim.scene import load_scene
from tests.io.recordings import write_recording

READERS: dict[str, Callable[[Path], object]] = {
    "recording.toml": read_toml,
    "sensor.yaml": read_mapping,
    "calibration.toml": read_mapping,
    "image.png": lambda path: read_grey(path, 24, 16),
    "cloud.ply": read_ply,
    "results.parquet": ResultTable.read,
    "motion.npz": Motion.load,
    "parts.csv": read_parts,
    "scene.toml": lambda path: load_scene(str(path)),
    "config.toml": lambda path: resolve("best", path, ()),
}


def refused(action: Callable[[], object], pattern: str) -> None:
    with pytest.raises(AirgroundError) as caught:
        action()
    assert re.search(pattern, str(caught.value)), str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", READERS)
def test_a_pipe_does_not_wait_for_ever(name: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / name)
    refused(lambda: READERS[name](tmp_path / name), rf"{name}.*is a pipe, expected a file")


@pytest.mark.parametrize("name", READERS)
def test_a_device_without_end_is_not_read(name: str, tmp_path: Path) -> None:
    (tmp_path / name).symlink_to("/dev/zero")
    refused(lambda: READERS[name](tmp_path / name), rf"{name}.*is a device, expected a file")


@pytest.mark.parametrize("name", READERS)
def test_a_sparse_file_does_not_fill_the_memory(name: str, tmp_path: Path) -> None:
    with (tmp_path / name).open("wb") as file:
        file.truncate(1 << 40)
    refused(lambda: READERS[name](tmp_path / name), rf"{name}.*has 1048576 MiB, expected at most")


def test_a_pipe_in_a_recording_is_named(tmp_path: Path) -> None:
    recording = write_recording(tmp_path / "ours")
    samples = recording / "mav0/imu0/data.csv"
    samples.unlink()
    os.mkfifo(samples)
    refused(lambda: Recording.open(recording).verify(), r"imu0/data\.csv.*is a pipe")


@pytest.mark.parametrize("key", ["a", '"a b"', "a-1", "'.'"])
def test_keys_of_ten_thousands_of_levels_are_refused_at_once(key: str, tmp_path: Path) -> None:
    path = tmp_path / "recording.toml"
    path.write_text(f"x = 1\n[{'.'.join([key] * 30_000)}]\n")
    refused(lambda: read_toml(path), "more than 64 levels")


def test_numbers_and_sentences_are_no_deep_keys(tmp_path: Path) -> None:
    path = tmp_path / "recording.toml"
    numbers = ", ".join(["1.5"] * 500)
    path.write_text(f'x = [{numbers}]\ny = "{"One sentence. " * 100}"\n# {"a.b " * 200}\n')
    assert len(read_toml(path)["x"]) == 500


def test_a_small_file_of_huge_arrays_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "motion.npz"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("a.npy", "w") as a,
    ):
        for _ in range(1100):
            a.write(bytes(1 << 20))
    assert path.stat().st_size < 2 << 20
    refused(lambda: Motion.load(path), "its arrays have .* bytes, expected at most")


def test_files_and_links_to_them_are_read(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"one\r\ntwo\n")
    (tmp_path / "link").symlink_to(path)
    assert read_bytes(tmp_path / "link", SETTINGS_LIMIT) == b"one\r\ntwo\n"
    assert read_text(path, SETTINGS_LIMIT) == "one\ntwo\n"
    check_file(path)
    with pytest.raises(OSError, match="at most"):
        read_bytes(path, 3)
    with pytest.raises(FileNotFoundError):
        read_bytes(tmp_path / "absent", 3)
    with pytest.raises(OSError, match="is a folder"):
        read_bytes(tmp_path, 3)


def test_a_file_may_be_empty(tmp_path: Path) -> None:
    (tmp_path / "empty").touch()
    assert read_bytes(tmp_path / "empty", 0) == b""
    assert np.frombuffer(read_bytes(tmp_path / "empty", 0), np.uint8).size == 0


def test_a_sparse_list_below_the_limit_is_not_read_whole(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("1,2,3\n")
    with path.open("r+b") as file:
        file.truncate(TEXT_LIMIT)
    tracemalloc.start()
    with pytest.raises(OSError, match="has a zero byte, expected text"):
        read_text(path, TEXT_LIMIT)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 << 20


def test_a_limit_can_be_raised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "file"
    path.write_bytes(bytes(41))
    monkeypatch.delenv(INPUT_LIMITS, raising=False)
    with pytest.raises(OSError, match=rf"expected at most 0 \({INPUT_LIMITS}=5 allows it\)"):
        read_bytes(path, 10)
    monkeypatch.setenv(INPUT_LIMITS, "4")
    with pytest.raises(OSError, match=rf"{INPUT_LIMITS}=5 allows it"):
        read_bytes(path, 10)
    for enough in ("5", "4.1", "1024"):
        monkeypatch.setenv(INPUT_LIMITS, enough)
        assert read_bytes(path, 10) == bytes(41)
    monkeypatch.setenv(INPUT_LIMITS, "")
    assert read_bytes(path, 41) == bytes(41)


def test_what_no_factor_allows_names_none(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(bytes(1025))
    with pytest.raises(OSError, match=r"expected at most 0: '[^']*file'$"):
        read_bytes(path, 1)


@pytest.mark.parametrize("value", ["0", "0.5", "-1", "1025", "nan", "inf", "four", "4x"])
def test_another_factor_is_refused(
    value: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv(INPUT_LIMITS, value)
    with pytest.raises(InputError, match=f"{INPUT_LIMITS}: expected a number from 1 to 1024"):
        check_file(tmp_path / "file")


def test_more_pixels_can_be_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("airground.io.images.PIXEL_LIMIT", 100)
    cv2.imwrite(str(tmp_path / "a.png"), np.zeros((12, 13), np.uint8))
    monkeypatch.delenv(INPUT_LIMITS, raising=False)
    refused(
        lambda: read_grey(tmp_path / "a.png", 13, 12),
        rf"13x12 are more than 100 pixels \({INPUT_LIMITS}=2 allows it\)",
    )
    monkeypatch.setenv(INPUT_LIMITS, "2")
    assert read_grey(tmp_path / "a.png", 13, 12).shape == (12, 13)
