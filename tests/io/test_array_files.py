"""Files of arrays that are damaged, bombs, or no files."""

from __future__ import annotations

import io
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


@pytest.mark.parametrize("shape", [(1 << 50,), (1 << 20, 1 << 20, 3), (1,), (-1, 3), ()])
def test_an_array_has_the_size_that_its_header_claims(
    tmp_path: Path, shape: tuple[int, ...]
) -> None:
    """numpy would allocate what the header claims: most of it ended as out of memory."""
    member = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(member, header)
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("stamps.npy", member.getvalue() + bytes(24))
    with pytest.raises(ValueError, match=r"array 'stamps\.npy' claims shape .*; there are 24"):
        read_arrays(tmp_path / "a.npz")


def test_arrays_of_objects_and_later_versions_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", one=np.array([{}], object))
    with pytest.raises(ValueError, match="holds Python objects"):
        read_arrays(tmp_path / "a.npz")
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive:
        archive.writestr("a.npy", b"\x93NUMPY\x09\x00" + bytes(100))
    with pytest.raises(ValueError, match="has a header of version"):
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
    np.savez_compressed(tmp_path / "small.npz", a=np.zeros(70 << 20, np.uint8))
    with pytest.raises(ValueError, match="more than 100 times its own size"):
        read_arrays(tmp_path / "small.npz")
    np.savez_compressed(tmp_path / "smaller.npz", a=np.zeros(60 << 20, np.uint8))
    assert len(read_arrays(tmp_path / "smaller.npz")["a"]) == 60 << 20
