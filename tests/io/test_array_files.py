"""Files of arrays that are damaged, bombs, or no files."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path

import numpy as np
import pytest

from airground.io.array_files import UNREADABLE_ARRAYS, read_arrays


def test_arrays_are_read_by_name(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", one=np.arange(3), two=np.eye(2))
    found = read_arrays(tmp_path / "a.npz")
    assert sorted(found) == ["one", "two"]
    assert found["two"].tolist() == np.eye(2).tolist()


@pytest.mark.parametrize("kept", [0, 10, 200, 400])
def test_a_file_that_is_cut(tmp_path: Path, kept: int) -> None:
    np.savez(tmp_path / "a.npz", one=np.arange(30), two=np.eye(2))
    (tmp_path / "b.npz").write_bytes((tmp_path / "a.npz").read_bytes()[:kept])
    with pytest.raises(UNREADABLE_ARRAYS):
        read_arrays(tmp_path / "b.npz")


def test_a_pipe_and_a_bomb(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.npz")
    with pytest.raises(OSError, match="is a pipe"):
        read_arrays(tmp_path / "pipe.npz")
    with (
        zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("a.npy", "w", force_zip64=True) as member,
    ):
        for _ in range(1025):
            member.write(bytes(1 << 20))
    with pytest.raises(ValueError, match="expected at most"):
        read_arrays(tmp_path / "bomb.npz")
