"""Folders that are whole or not there, after errors and kills."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from sim.partial_folder import is_being_written, partial_folder, whole_file

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
        assert is_being_written(out)
        assert not is_being_written(tmp_path / "ou")
    finally:
        process.kill()
        process.wait()
    assert not is_being_written(out)


def test_other_names_are_left_alone(tmp_path: Path) -> None:
    names = (".out2.partial-aaaaaaaa", ".out.partial", "out.partial-aaaaaaaa", ".out.partial-a")
    others = [tmp_path / name for name in names]
    for other in others:
        other.mkdir()
    with partial_folder(tmp_path / "out"):
        assert all(other.exists() for other in others)


def test_a_file_is_replaced_when_whole(tmp_path: Path) -> None:
    file = tmp_path / "file"
    for text in ("first", "second"):
        (tmp_path / ".file.partial-killed__").write_text("half")
        with whole_file(file) as partial:
            partial.write_text(text)
            assert set(tmp_path.iterdir()) == {partial, *([file] if text == "second" else [])}
        assert list(tmp_path.iterdir()) == [file]
        assert file.read_text() == text
    (tmp_path / "plain").touch()
    assert file.stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_file_stays_as_it_was_after_an_error(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("first")

    def fail() -> None:
        with whole_file(file) as partial:
            partial.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert list(tmp_path.iterdir()) == [file]
    assert file.read_text() == "first"
