"""Temporary folders after errors and kills."""

from __future__ import annotations

import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from airground.core.scratch_folder import PREFIX, ScratchFolder

STAYS = """
import sys, time
from pathlib import Path
from airground.core.scratch_folder import ScratchFolder
with ScratchFolder(Path(sys.argv[1])) as folder:
    (folder.path / "file").write_text("half")
    print(folder.path, flush=True)
    time.sleep(600)
"""


def process_in(parent: Path) -> tuple[subprocess.Popen[str], Path]:
    """A process with a scratch folder, and that folder."""
    words = [sys.executable, "-c", STAYS, str(parent)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


def test_only_its_user_may_enter_and_it_goes_with_the_block(tmp_path: Path) -> None:
    with ScratchFolder(tmp_path) as folder:
        assert folder.path.parent == tmp_path
        assert stat.S_IMODE(folder.path.stat().st_mode) == 0o700
        (folder.path / "file").touch()
        assert list(tmp_path.iterdir()) == [folder.path]
    assert list(tmp_path.iterdir()) == []
    folder.close()


def test_an_error_leaves_nothing(tmp_path: Path) -> None:
    def fail() -> None:
        with ScratchFolder(tmp_path):
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_process_left_is_removed_and_what_a_live_one_has_stays(
    tmp_path: Path,
) -> None:
    killed, left = process_in(tmp_path)
    alive, used = process_in(tmp_path)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    other = tmp_path / f"{PREFIX}link"
    other.symlink_to(tmp_path.parent)
    try:
        assert (left / "file").exists()
        with ScratchFolder(tmp_path):
            assert not left.exists()
            assert (used / "file").exists()
            assert other.is_symlink()
            assert tmp_path.parent.exists()
    finally:
        alive.kill()
        alive.wait()


def test_a_parent_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="missing"):
        ScratchFolder(tmp_path / "missing")
