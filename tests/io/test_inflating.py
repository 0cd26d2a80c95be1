"""Compressed chunks, messages and files of bags that inflate to more than they may."""

from __future__ import annotations

import bz2
from pathlib import Path

import lz4.frame
import pytest
from rosbags.rosbag1 import reader as rosbag1
from rosbags.rosbag2 import reader as rosbag2
from rosbags.rosbag2 import storage_mcap

from airground.io.input_limits import INPUT_LIMITS
from airground.io.ros import inflating
from airground.io.ros.inflating import bound_inflating, zstd

COMPRESS = {"zstd": zstd.compress, "lz4": lz4.frame.compress, "bz2": bz2.compress}
SOME = b"0123456789" * 1000


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    bound_inflating()
    monkeypatch.delenv(INPUT_LIMITS, raising=False)
    monkeypatch.setattr(inflating, "CHUNK_LIMIT", 100_000)
    monkeypatch.setattr(inflating, "FILE_FLOOR", 100_000)


@pytest.mark.parametrize("kind", ["zstd", "lz4"])
def test_chunks_of_mcap(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    inflate = storage_mcap.DECOMPRESSORS[kind]
    data = COMPRESS[kind](SOME)
    assert inflate(data, len(SOME)) == SOME
    assert inflate(COMPRESS[kind](SOME[:7000]) + COMPRESS[kind](SOME[7000:]), len(SOME)) == SOME
    with pytest.raises(ValueError, match=f"more than {len(SOME) - 1} bytes"):
        inflate(data, len(SOME) - 1)
    with pytest.raises(ValueError, match=rf"states 100001 bytes.*{INPUT_LIMITS}=2 allows it"):
        inflate(data, 100_001)
    with pytest.raises(ValueError, match="truncated"):
        inflate(data[:-5], len(SOME))
    monkeypatch.setenv(INPUT_LIMITS, "2")
    assert inflate(COMPRESS[kind](bytes(150_000)), 150_000) == bytes(150_000)


@pytest.mark.parametrize("kind", ["lz4", "bz2"])
def test_chunks_of_ros_1(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    inflate = rosbag1.decompressors[kind]
    assert inflate(COMPRESS[kind](SOME)) == SOME
    with pytest.raises(ValueError, match="more than 100000 bytes"):
        inflate(COMPRESS[kind](bytes(100_001)))
    monkeypatch.setenv(INPUT_LIMITS, "2")
    assert len(inflate(COMPRESS[kind](bytes(150_000)))) == 150_000


def test_messages_and_files_of_ros_2(tmp_path: Path) -> None:
    assert rosbag2.zstd.decompress(zstd.compress(SOME)) == SOME
    with pytest.raises(ValueError, match="more than"):
        rosbag2.zstd.decompress(zstd.compress(bytes(100_001)))
    for size in (100_000, 100_001):
        (tmp_path / str(size)).write_bytes(zstd.compress(bytes(size)))
    with (tmp_path / "100000").open("rb") as file, rosbag2.zstd.open(file, "rb") as inside:
        assert inside.read(70_000) + inside.read(70_000) == bytes(100_000)
    with (tmp_path / "100001").open("rb") as file, rosbag2.zstd.open(file, "rb") as inside:
        assert len(inside.read(70_000)) == 70_000
        with pytest.raises(ValueError, match="compressed file inflates to more than 100000"):
            inside.read(70_000)
