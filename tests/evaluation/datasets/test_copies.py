"""What exports copy passes the gate for inputs, also if it changed since it was opened."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from airground.errors import AirgroundError
from airground.io.image_files import ImageFiles
from airground.io.recording import Recording
from evaluation.datasets.ros_messages import compressed_image
from evaluation.datasets.simulated import copy_images
from tests.io.recordings import write_recording

COPIES: dict[str, Callable[[Path, ImageFiles], object]] = {
    "copied": lambda out, files: copy_images(files.ground_depth_files, out / "copies"),
    "depth": lambda out, files: files.depth_png(0),
    "message": lambda out, files: compressed_image(0, "camera", files.ground_depth_files[0]),
}


@pytest.mark.parametrize("copy", COPIES)
def test_a_pipe_or_a_huge_file_in_place_of_an_image(copy: str, tmp_path: Path) -> None:
    files = Recording.open(write_recording(tmp_path / "ours")).images
    assert isinstance(files, ImageFiles)
    image = files.ground_depth_files[0]
    data = image.read_bytes()
    image.unlink()
    os.mkfifo(image)
    with pytest.raises(AirgroundError, match=f"{image.name}: cannot be read: is a pipe"):
        COPIES[copy](tmp_path, files)
    image.unlink()
    with image.open("wb") as file:
        file.truncate(1 << 40)
    (tmp_path / "copies").rmdir() if (tmp_path / "copies").exists() else None
    with pytest.raises(AirgroundError, match=f"{image.name}: cannot be read: has 1048576 MiB"):
        COPIES[copy](tmp_path, files)
    image.write_bytes(data)
    (tmp_path / "copies").rmdir() if (tmp_path / "copies").exists() else None
    COPIES[copy](tmp_path, files)


def test_copies_are_the_same_bytes(tmp_path: Path) -> None:
    files = Recording.open(write_recording(tmp_path / "ours")).images
    assert isinstance(files, ImageFiles)
    copy_images(files.mav_files, tmp_path / "copies")
    for file in files.mav_files:
        assert (tmp_path / "copies" / file.name).read_bytes() == file.read_bytes()
    assert files.depth_png(0) == files.ground_depth_files[0].read_bytes()
