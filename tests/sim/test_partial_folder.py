"""Folders that are whole or not there, after errors and kills."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from sim.partial_folder import partial_folder

WRITES_FOR_EVER = """
import sys, time
from pathlib import Path
from sim.partial_folder import partial_folder
with partial_folder(Path(sys.argv[1])) as folder:
    (folder / "half").write_text("half")
    print("writing", flush=True)
    time.sleep(600)
"""


def writer(path: Path) -> subprocess.Popen[str]:
    """A process that is writing `path`."""
    words = [sys.executable, "-c", WRITES_FOR_EVER, str(path)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "writing\n"
    return process


def test_it_appears_when_renamed(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    with partial_folder(out) as folder:
        (folder / "file").touch()
        assert not out.exists()
        folder.rename(out)
    assert [path.name for path in (tmp_path / "deep").rglob("*")] == ["out", "file"]


def test_an_error_leaves_nothing(tmp_path: Path) -> None:
    def fail() -> None:
        with partial_folder(tmp_path / "out") as folder:
            (folder / "file").touch()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path: Path) -> None:
    out = tmp_path / "a[b]*"
    process = writer(out)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert len(list(tmp_path.iterdir())) == 1
    with partial_folder(out) as folder:
        assert list(tmp_path.iterdir()) == [folder]
    assert list(tmp_path.iterdir()) == []


def test_what_a_living_process_writes_stays(tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = writer(out)
    try:
        (theirs,) = tmp_path.iterdir()
        with partial_folder(out) as ours:
            assert set(tmp_path.iterdir()) == {theirs, ours}
        assert (theirs / "half").read_text() == "half"
    finally:
        process.kill()
        process.wait()


def test_other_names_are_left_alone(tmp_path: Path) -> None:
    others = [tmp_path / ".out2.x.partial", tmp_path / ".out.partial", tmp_path / "out.x.partial"]
    for other in others:
        other.mkdir()
    with partial_folder(tmp_path / "out"):
        assert all(other.exists() for other in others)
