"""An output folder is whole or not there."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from airground.errors import InputError
from evaluation.setup.output import fresh_folder


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
