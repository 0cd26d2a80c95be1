"""Trajectories survive the disk to the nanosecond; wrong lines are named."""

from pathlib import Path

import numpy as np
import pytest
from evo.tools import file_interface
from hypothesis import given
from hypothesis import strategies as st

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import RecordingError
from airground.io.tum import format_stamp, parse_stamp, read_tum, write_tum


@given(st.integers(0, 2**62))
def test_stamps_are_exact(stamp: int) -> None:
    assert parse_stamp(format_stamp(stamp)) == stamp


def trajectory() -> Trajectory:
    rng = np.random.default_rng(0)
    stamps = (1_700_000_000_000_000_000 + np.cumsum(rng.integers(1, 10**9, 20))).tolist()
    return Trajectory.from_poses(
        stamps, [SE3.from_rotation_vector(rng.normal(size=3), rng.normal(size=3)) for _ in stamps]
    )


def test_a_trajectory_comes_back(tmp_path: Path) -> None:
    write_tum(tmp_path / "a.tum", trajectory())
    read = read_tum(tmp_path / "a.tum")
    np.testing.assert_array_equal(read.stamps_ns, trajectory().stamps_ns)
    np.testing.assert_allclose(read.rotations, trajectory().rotations, atol=1e-8)
    np.testing.assert_allclose(read.translations, trajectory().translations, atol=1e-9)


def test_evo_reads_the_same_poses(tmp_path: Path) -> None:
    write_tum(tmp_path / "a.tum", trajectory())
    evo = file_interface.read_tum_trajectory_file(tmp_path / "a.tum")
    for index, matrix in enumerate(evo.poses_se3):
        np.testing.assert_allclose(matrix, trajectory()[index].matrix(), atol=1e-8)


@pytest.mark.parametrize(
    ("line", "pattern"),
    [
        ("2.0 0 0 nan 0 0 0 1", ":3: .*not finite"),
        ("1.0 0 0 0 0 0 0 1", ":3: .*strictly increase"),
        ("0.5 0 0 0 0 0 0 1", ":3: .*strictly increase"),
        ("2.0 0 0 0 0 0 1", ":3: .*7 fields"),
        ("2.0 0 0 0 0 0 0 0", ":3: .*length 1"),
        ("later 0 0 0 0 0 0 1", ":3: 'later'"),
        ("2.0 0 0 zero 0 0 0 1", ":3: .*zero"),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, line: str, pattern: str) -> None:
    file = tmp_path / "a.tum"
    file.write_text(f"# poses\n1.0 0 0 0 0 0 0 1\n{line}\n")
    with pytest.raises(RecordingError, match=pattern) as caught:
        read_tum(file)
    assert str(file) in str(caught.value)


def test_an_empty_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.tum").write_text("# nothing\n")
    with pytest.raises(RecordingError, match="no pose"):
        read_tum(tmp_path / "a.tum")
