"""PLY files of any kind against Open3D, and damaged ones that end its reader's process."""

from __future__ import annotations

import struct
import tracemalloc
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

from airground.errors import InputError
from airground.io.ply_elements import columns, read_elements

XYZ = ("x", "y", "z")
HEADER = "".join(f"property double {axis}\n" for axis in XYZ)
FACES = "property list uchar int vertex_indices\n"


@pytest.mark.parametrize("ascii_", [True, False])
def test_meshes_are_read_as_by_open3d(tmp_path: Path, ascii_: bool) -> None:
    file, mesh = tmp_path / "a.ply", o3d.geometry.TriangleMesh.create_sphere(1.3, 7)
    o3d.io.write_triangle_mesh(file, mesh, write_ascii=ascii_)
    tables = read_elements(file, ("vertex", "face"))
    read = o3d.io.read_triangle_mesh(file)
    np.testing.assert_array_equal(columns(file, tables["vertex"], XYZ), np.asarray(read.vertices))
    np.testing.assert_array_equal(tables["face"]["vertex_indices"], np.asarray(read.triangles))


def test_numbers_with_the_large_byte_first(tmp_path: Path) -> None:
    head = "ply\nformat binary_big_endian 1.0\ncomment one\nelement vertex 2\n" + HEADER
    rows = struct.pack(">6d", 1, 2, 3, -4, 5e-3, 6e9)
    (tmp_path / "a.ply").write_bytes(f"{head}end_header\n".encode() + rows)
    table = read_elements(tmp_path / "a.ply", ("vertex",))["vertex"]
    np.testing.assert_array_equal(columns(tmp_path, table, XYZ), [[1, 2, 3], [-4, 5e-3, 6e9]])


def mixed(kind: str, body: bytes, vertices: int = 4) -> bytes:
    head = f"ply\nformat {kind} 1.0\nelement vertex {vertices}\n{HEADER}element face 2\n{FACES}"
    return f"{head}end_header\n".encode() + body


SQUARE = struct.pack("<12d", *range(12))
POLYGONS = struct.pack("<B4iB3i", 4, 0, 1, 2, 3, 3, 0, 1, 2)


def test_vertices_of_a_mesh_of_mixed_polygons(tmp_path: Path) -> None:
    file = tmp_path / "a.ply"
    file.write_bytes(mixed("binary_little_endian", SQUARE + POLYGONS))
    table = read_elements(file, ("vertex",))["vertex"]
    np.testing.assert_array_equal(columns(file, table, XYZ), np.arange(12.0).reshape(4, 3))
    with pytest.raises(InputError, match=r"is truncated|differ in length"):
        read_elements(file, ("face",))


TEXT = b"0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
LINES = b"3 0 1 2\n3 0 1 3\n"
ASCII = mixed("ascii", TEXT + LINES)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (ASCII.replace(b"element face 2", b"element vertex 2"), "header line 'element vertex 2'"),
        (ASCII.replace(b"element face 2", b"element face 3"), "is truncated: 3 rows of 'face'"),
        (ASCII.replace(b"3 0 1 3", b"4 0 1 3"), "differ in length"),
        (ASCII.replace(b"3 0 1 3", b"3 0 1"), "'face' is damaged"),
        (ASCII.replace(b"1 0 0\n", b"1 x 0\n"), "'vertex' is damaged"),
        (ASCII.replace(b"1 0 0\n", b"1 \xff 0\n"), "'vertex' is damaged"),
        (ASCII.replace(b"uchar int", b"float int"), "header line 'property list float int"),
        (ASCII.replace(b"vertex 4", b"vertex -4"), "header line 'element vertex -4'"),
        (ASCII.replace(b"format ascii 1.0\n", b""), "lacks a format"),
        (ASCII.replace(b"end_header", b"end_heade"), "is no PLY file"),
        (ASCII.replace(b"ascii 1.0\n", b"ascii 1.0\n" + b"comment\n" * 2000), "more than 1000"),
        (ASCII + b"7\n", "has more after the last row"),
        (mixed("binary_little_endian", SQUARE[:-1]), "is truncated: 4 rows of 'vertex' need 96"),
        (mixed("binary_little_endian", SQUARE, 10**17), "is truncated"),
        (mixed("binary_little_endian", SQUARE + b"\xff" * 26), "a list 'vertex_indices' has"),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, data: bytes, message: str) -> None:
    (tmp_path / "a.ply").write_bytes(data)
    with pytest.raises(InputError, match=message) as refusal:
        read_elements(tmp_path / "a.ply", ("vertex", "face"))
    assert "\n" not in str(refusal.value)


def test_elements_that_are_not_there(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(ASCII)
    assert read_elements(tmp_path / "a.ply", ("edge",)) == {}
    with pytest.raises(InputError, match="lacks red"):
        columns(tmp_path, read_elements(tmp_path / "a.ply", ("vertex",))["vertex"], ("x", "red"))


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
def test_more_rows_than_the_file_can_hold_are_not_read(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "a.ply"
    file.write_bytes(mixed(kind, b"0 0 0\n" * 10, vertices=10**9))
    with pytest.raises(InputError, match=r"is truncated: 1000000000 rows .* there are 60"):
        read_elements(file, ("vertex",))


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("head", ["", "element vertex 4", "element vertex 10"])
def test_a_sparse_file_is_not_read_whole(tmp_path: Path, kind: str, head: str) -> None:
    file = tmp_path / "a.ply"
    start = f"ply\nformat {kind} 1.0\n{head}\n{HEADER}end_header\n" if head else ""
    file.write_bytes(start.encode())
    with file.open("r+b") as opened:
        opened.truncate(7 << 30)
    tracemalloc.start()
    with pytest.raises(InputError, match=r"no PLY file|has more after|more than \d+ bytes"):
        read_elements(file, ("vertex",))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 16 << 20


def test_a_row_without_end_and_empty_lines_at_the_end(tmp_path: Path) -> None:
    file = tmp_path / "a.ply"
    file.write_bytes(ASCII + b"\n \r\n\n")
    assert len(read_elements(file, ("vertex", "face"))["face"]) == 2
    file.write_bytes(ASCII.replace(b"\n", b"\r\n"))
    assert len(read_elements(file, ("vertex", "face"))["face"]) == 2
    file.write_bytes(ASCII + b"\n 1")
    with pytest.raises(InputError, match="has more after"):
        read_elements(file, ("vertex", "face"))
