"""An output folder is whole or not there."""

from __future__ import annotations

import errno
import subprocess
import sys
from pathlib import Path

import pytest

from airground.errors import InputError
from evaluation.setup import console
from evaluation.setup.output import check_free, fresh_folder, write_whole

WRITES = """
import sys, time
from pathlib import Path
from evaluation.setup import console
from evaluation.setup.output import fresh_folder
def work():
    with fresh_folder(Path(sys.argv[1])) as folder:
        for name in "abc":
            (folder / name).write_text(sys.argv[2])
            time.sleep(0.005)
print(flush=True)
sys.stdin.readline()
sys.exit(console.run(work))
"""


def test_it_appears_when_whole(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "results"
    with fresh_folder(out) as folder:
        (folder / "a").write_text("1")
        assert not out.exists()
    assert [file.name for file in out.parent.iterdir()] == ["results"]
    assert (out / "a").read_text() == "1"
    assert out.stat().st_mode & 0o777 == (tmp_path / "deep").stat().st_mode & 0o777


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, SystemExit])
def test_an_error_leaves_nothing(error: type[BaseException], tmp_path: Path) -> None:
    def write_and_fail() -> None:
        with fresh_folder(tmp_path / "results") as folder:
            (folder / "a").write_text("1")
            raise error

    with pytest.raises(error):
        write_and_fail()
    assert list(tmp_path.iterdir()) == []


def test_what_exists_is_refused_before_any_work(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="exists already"), fresh_folder(tmp_path):
        pytest.fail("work was done")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match="exists already"), fresh_folder(tmp_path / "link"):
        pytest.fail("work was done")


def test_what_appeared_meanwhile_is_kept(tmp_path: Path) -> None:
    out = tmp_path / "results"

    def write_beside_another() -> None:
        with fresh_folder(out):
            out.mkdir()
            (out / "theirs").write_text("1")

    with pytest.raises(InputError, match="exists already"):
        write_beside_another()
    assert [file.name for file in out.iterdir()] == ["theirs"]


def test_a_parent_that_is_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot create it"), fresh_folder(tmp_path / "file" / "x"):
        pytest.fail("work was done")


def test_a_full_disk_gets_a_name(tmp_path: Path) -> None:
    out = tmp_path / "results"
    with pytest.raises(OSError, match=str(out)) as error, fresh_folder(out):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert error.value.errno == errno.ENOSPC
    assert list(tmp_path.iterdir()) == []


def test_of_two_processes_at_once_one_writes_all(tmp_path: Path) -> None:
    for attempt in range(5):
        out = tmp_path / str(attempt)
        pair = [
            subprocess.Popen(
                [sys.executable, "-c", WRITES, str(out), name],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            for name in ("first", "second")
        ]
        for process in pair:
            assert process.stdout is not None
            process.stdout.readline()
        for process in pair:
            assert process.stdin is not None
            process.stdin.write("\n")
            process.stdin.flush()
        said = [process.communicate()[1] for process in pair]
        codes = [process.returncode for process in pair]
        assert sorted(codes) == [console.EXIT_OK, console.EXIT_ERROR]
        (line,) = said[codes.index(console.EXIT_ERROR)].splitlines()
        assert line.startswith(f"airground: error: --out {out}: ")
        assert len({(out / name).read_text() for name in "abc"}) == 1
        assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []


def test_what_another_process_is_writing_is_refused_before_any_work(tmp_path: Path) -> None:
    with fresh_folder(tmp_path / "out"):
        with pytest.raises(InputError, match="another run is writing it"):
            check_free(tmp_path / "out")
        check_free(tmp_path / "ou")
    with pytest.raises(InputError, match="exists already"):
        check_free(tmp_path / "out")


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError) as error:
        write_whole(tmp_path / "missing" / "file", "text")
    assert error.value.filename == str(tmp_path / "missing" / "file")
