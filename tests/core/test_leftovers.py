"""What killed processes leave differs from what live ones use by its lock."""

from __future__ import annotations

import logging
import multiprocessing
import os
import subprocess
import sys
from pathlib import Path

import pytest

from airground.core import leftovers
from airground.core.leftovers import (
    is_held,
    locked,
    named,
    new_locked,
    remove_left,
    size_bytes,
)

NAMES = r"left-[a-z0-9_]{8}"


def make_and_remove(parent: Path, count: int) -> None:
    """Make locked folders while other processes remove those without a lock."""
    for _ in range(count):
        with new_locked(parent, "left-", folder=True) as folder:
            (folder / "file").write_text("whole")
            remove_left(parent, NAMES)
            assert (folder / "file").read_text() == "whole"


def test_it_goes_with_the_block_or_stays_under_its_new_name(tmp_path: Path) -> None:
    for folder in (True, False):
        with new_locked(tmp_path, "left-", folder=folder) as path:
            assert path.is_dir() == folder
            assert is_held(path)
        assert list(tmp_path.iterdir()) == []
        with new_locked(tmp_path, "left-", folder=folder) as path:
            path.rename(tmp_path / f"kept-{folder}")
        (kept,) = tmp_path.iterdir()
        assert not is_held(kept)
        kept.rmdir() if folder else kept.unlink()


def test_what_has_no_lock_is_removed_and_logged_in_one_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    for name in ("left-aaaaaaaa", "left-bbbbbbbb"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "deep").mkdir()
        (tmp_path / name / "deep" / "half").write_bytes(bytes(1 << 20))
    (tmp_path / "left-cccccccc").write_bytes(bytes(1 << 20))
    kept = [tmp_path / name for name in ("left-short", "left-AAAAAAAA", ".left-aaaaaaaa", "left")]
    for path in kept:
        path.mkdir()
    link = tmp_path / "left-dddddddd"
    link.symlink_to(kept[0])
    pipe = tmp_path / "left-eeeeeeee"
    os.mkfifo(pipe)
    with (
        caplog.at_level(logging.INFO, "airground"),
        new_locked(tmp_path, "left-", folder=True) as ours,
    ):
        removed = remove_left(tmp_path, NAMES)
        assert set(tmp_path.iterdir()) == {*kept, link, pipe, ours}
    assert [path.name[-1] for path in removed] == ["a", "b", "c"]
    (line,) = caplog.messages
    assert all(str(path) in line for path in removed)
    assert "(3.0 MiB)" in line
    caplog.clear()
    with caplog.at_level(logging.INFO, "airground"):
        assert remove_left(tmp_path, NAMES) == []
        assert remove_left(tmp_path / "missing", NAMES) == []
    assert caplog.messages == []


def test_a_name_that_another_took_between_creation_and_lock_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Path] = []

    def taken(parent: Path, prefix: str, folder: bool) -> Path:
        path = new(parent, prefix, folder)
        if not made:
            remove_left(parent, NAMES)
            assert not path.exists()
        made.append(path)
        return path

    new = leftovers._new
    monkeypatch.setattr(leftovers, "_new", taken)
    with new_locked(tmp_path, "left-", folder=True) as path:
        assert [path] == made[1:] == list(tmp_path.iterdir())


def test_processes_do_not_take_each_others_folders(tmp_path: Path) -> None:
    spawn = multiprocessing.get_context("spawn")
    others = [spawn.Process(target=make_and_remove, args=(tmp_path, 200)) for _ in range(2)]
    for other in others:
        other.start()
    make_and_remove(tmp_path, 200)
    for other in others:
        other.join()
    assert [other.exitcode for other in others] == [0, 0]
    assert list(tmp_path.iterdir()) == []


def test_a_folder_under_another_name_is_not_locked_by_the_old_one(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    opened = os.open

    def and_replaced(path: Path, flags: int) -> int:
        descriptor = opened(path, flags)
        path.rename(tmp_path / "b")
        path.mkdir()
        return descriptor

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "open", and_replaced)
        with pytest.raises(FileNotFoundError, match="a"), locked(tmp_path / "a"):
            pytest.fail("locked")


def test_a_lock_ends_with_its_process(tmp_path: Path) -> None:
    code = (
        "import sys, time; from pathlib import Path\n"
        "from airground.core.leftovers import new_locked\n"
        "with new_locked(Path(sys.argv[1]), 'left-', folder=False) as path:\n"
        "    print(flush=True); time.sleep(600)"
    )
    words = [sys.executable, "-c", code, str(tmp_path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        (file,) = named(tmp_path, NAMES)
        assert is_held(file)
        assert remove_left(tmp_path, NAMES) == []
        process.kill()
        process.wait()
    assert not is_held(file)
    assert remove_left(tmp_path, NAMES) == [file]


def test_sizes_of_links_are_their_own(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    (tmp_path / "large").write_bytes(bytes(1000))
    (folder / "link").symlink_to("../large")
    (folder / "file").write_bytes(bytes(10))
    assert size_bytes(folder) == 10 + len("../large")
    assert size_bytes(tmp_path / "large") == 1000
    assert size_bytes(tmp_path / "missing") == 0
