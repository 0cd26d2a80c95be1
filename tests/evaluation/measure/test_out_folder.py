"""Folders that a run continues, and folders that it does not touch."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from airground.errors import InputError
from evaluation.measure.work.out_folder import LOCK, resumable_folder
from evaluation.measure.work.unit import Finished, UnitStore
from evaluation.setup.condition import Condition
from evaluation.table.rows import ResultTable, Row

ROW = Row("tiny", 0, 0, Condition("best", "slam", "none", "known"), "run", "recorded_s", 1.0, "s")
FOUND = Finished(ResultTable.from_rows([ROW]))


def fail_after_a_unit(out: Path) -> None:
    with resumable_folder(out) as folder:
        folder.store.write("key", {}, FOUND)
        (folder.results / "summary.json").write_text("first")
        (folder.scratch / "left").write_text("behind")
        raise RuntimeError


def fail_without_the_folder(out: Path, records: bool) -> None:
    with resumable_folder(out) as folder:
        shutil.rmtree(out)
        if records:
            (folder.recordings / ".a.partial-aaaaaaaa").mkdir(parents=True)
        raise OSError("gone")


def test_results_appear_when_all_are_complete(tmp_path: Path) -> None:
    out = tmp_path / "deep/out"
    with pytest.raises(RuntimeError):
        fail_after_a_unit(out)
    assert {file.name for file in out.iterdir()} == {LOCK, "units"}
    for text in ("second", "third"):
        with resumable_folder(out) as folder:
            assert "key" in folder.store
            (folder.results / "summary.json").write_text(text)
            (folder.results / "figures").mkdir()
            (folder.results / "figures" / text).touch()
        assert (out / "summary.json").read_text() == text
        assert [file.name for file in (out / "figures").iterdir()] == [text]
    assert {file.name for file in out.iterdir()} == {LOCK, "units", "summary.json", "figures"}


def test_a_run_without_results_leaves_no_folder(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), resumable_folder(tmp_path / "out"):
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_other_folders_are_refused_and_unchanged(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("precious")
    with pytest.raises(InputError, match="exists already"), resumable_folder(tmp_path):
        pass
    with (
        pytest.raises(InputError, match="cannot create it"),
        resumable_folder(tmp_path / "mine/out"),
    ):
        pass
    assert [file.name for file in tmp_path.iterdir()] == ["mine"]


def test_a_run_goes_on_where_its_folder_vanished_and_was_partly_made_again(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(OSError, match="gone"):
        fail_without_the_folder(out, records=True)
    assert [file.name for file in out.iterdir()] == ["recordings"]
    with resumable_folder(out) as folder:
        folder.store.write("key", {}, FOUND)
    assert {file.name for file in out.iterdir()} == {LOCK, "recordings", "units"}
    assert list((out / "recordings").iterdir()) == []


def test_a_folder_that_vanished_hides_no_error(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(OSError, match="gone"):
        fail_without_the_folder(out, records=False)
    assert not out.exists()


def test_what_a_killed_run_left_is_removed_and_logged(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    out = tmp_path / "out"
    with resumable_folder(out) as folder:
        folder.store.write("key", {}, FOUND)
    left = [".scratch", ".results", "recordings/.a.partial-aaaaaaaa", "units/.b.partial-bbbbbbbb"]
    for name in left:
        (out / name / "deep").mkdir(parents=True)
    with caplog.at_level("INFO", "airground"), resumable_folder(out) as folder:
        assert "key" in folder.store
    said = " ".join(caplog.messages)
    for name in left:
        assert str(out / name) in said
        assert not (out / name).exists()


def test_two_runs_do_not_share_a_folder(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with resumable_folder(out) as folder:
        folder.store.write("key", {}, FOUND)
        with pytest.raises(InputError, match="another run"), resumable_folder(out):
            pass
        assert folder.scratch.is_dir()
    with resumable_folder(out):
        pass


def test_partial_files_of_a_killed_run_are_removed(tmp_path: Path) -> None:
    store = UnitStore(tmp_path)
    store.write("whole", {"a": 1}, FOUND)
    half = tmp_path / ".key.partial-aaaaaaaa"
    half.mkdir()
    (half / "rows.parquet").write_bytes(b"PAR1")
    again = UnitStore(tmp_path)
    assert "whole" in again
    assert again.read("whole").table.frame["value"].tolist() == [1.0]
    assert [file.name for file in tmp_path.iterdir()] == ["whole"]


def test_a_damaged_unit_is_named(tmp_path: Path) -> None:
    store = UnitStore(tmp_path)
    store.write("key", {}, FOUND)
    (tmp_path / "key/rows.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match=r"key/rows\.parquet: no readable results table"):
        store.read("key")
