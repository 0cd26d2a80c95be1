"""`doctor --clean` removes what killed commands left, and nothing else."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from pathlib import Path

import pytest

from airground.core.leftovers import locked
from airground.core.scratch_folder import ScratchFolder
from evaluation import cli
from evaluation.commands.leftovers import State, finding, leftovers
from evaluation.measure.work.out_folder import resumable_folder
from evaluation.setup.doctor import Health
from evaluation.setup.output import continued_folder, fresh_folder

LEFT = (
    "here/.out.partial-aaaaaaaa",
    "here/.a.b.partial-b_b9bbbb",
    "here/results/.scratch",
    "here/results/.results",
    "here/results/units/.k.partial-cccccccc",
    "here/results/recordings/.r.partial-dddddddd",
    "here/.set.partial/train/.w.partial-eeeeeeee",
    "tmp/airground-scratch-ffffffff",
)
OTHERS = (
    "here/.out.partial",
    "here/.out.partial-short",
    "here/.out.partial-AAAAAAAA",
    "here/.partial-aaaaaaaa",
    "here/out.partial-aaaaaaaa",
    "here/out/.deep.partial-aaaaaaaa",
    "here/project/.scratch",
    "here/.set.partial/train/w",
    "here/results/units/key",
    "tmp/airground-scratch-x",
    "tmp/airground-scratch-ffffffff.txt",
    "tmp/.out.partial-aaaaaaaa",
)
"""Names that are not of leftovers, or in places that are not looked through."""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with all kinds of leftovers and other things, and a folder of temporary files."""
    for name in (*LEFT, *OTHERS):
        (tmp_path / name / "deep").mkdir(parents=True)
        (tmp_path / name / "deep/half").write_bytes(bytes(1 << 20))
    (tmp_path / "here/.file.partial-aaaaaaaa").write_text("half")
    (tmp_path / "here/results/.lock").touch()
    (tmp_path / "here/results/units/key/made_from.json").touch()
    (tmp_path / "here/.set.partial/dataset.json").touch()
    for name in (".lock", "units/others/file"):
        (tmp_path / "here/project" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "here/project" / name).touch()
    (tmp_path / "here/.link.partial-aaaaaaaa").symlink_to(tmp_path / "here/project")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    monkeypatch.setattr("evaluation.commands.leftovers.SYSTEM_TEMPORARY", tmp_path / "tmp")
    return tmp_path / "here"


def everything(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}


def clean(folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """The lines of `doctor --clean`, which must end with 0."""
    with pytest.raises(SystemExit) as ended:
        cli.main(["doctor", "--clean", str(folder)])
    assert not ended.value.code
    return capsys.readouterr().out.splitlines()


def test_leftovers_are_listed_with_their_sizes_and_removed(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = everything(here.parent)
    lines = clean(here, capsys)
    gone = {name for name in before if name.startswith((*LEFT, "here/.file.partial-aaaaaaaa"))}
    gone = {name for name in gone if not name.startswith("tmp/airground-scratch-ffffffff.txt")}
    assert everything(here.parent) == before - gone
    for name in LEFT:
        assert f"{here.parent / name}  1.0 MiB  removed" in lines
    assert f"{here / '.set.partial'}  2.0 MiB  kept, continued by the same command" in lines
    assert lines[-1] == "9 of 10 removed, 8.0 MiB"
    assert clean(here, capsys)[-1] == "0 of 1 removed, 0.0 MiB"


def test_what_a_running_process_uses_is_listed_and_kept(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clean(here, capsys)
    with ExitStack() as stack:
        used = [
            stack.enter_context(fresh_folder(here / "new")),
            stack.enter_context(resumable_folder(here / "results")).scratch,
            stack.enter_context(ScratchFolder()).path,
        ]
        stack.enter_context(continued_folder(here / ".set.partial"))
        before = everything(here.parent)
        lines = clean(here, capsys)
        assert everything(here.parent) == before
        for path in [*used, here / "results/.results"]:
            assert f"{path}  0.0 MiB  kept, in use by a running process" in lines
        assert f"{here / '.set.partial'}  1.0 MiB  kept, in use by a running process" in lines
        assert finding(leftovers(here)).health is Health.FINE
        used[0].rmdir()
        used[0].mkdir()  # for the end of the block


def test_what_is_locked_after_it_was_listed_is_kept(here: Path) -> None:
    from evaluation.commands.leftovers import clean as remove

    found = leftovers(here)
    out = here / ".out.partial-aaaaaaaa"
    assert {one.path: one.state for one in found}[out] is State.LEFT
    with locked(out):
        assert out not in [one.path for one in remove(found)]
    assert (out / "deep/half").exists()


def test_doctor_names_them(here: Path) -> None:
    found = finding(leftovers(here))
    assert found.health is Health.POOR
    assert found.detail == "9 here and among temporary files, 8.0 MiB"
    assert "doctor --clean" in found.remedy


@pytest.mark.parametrize(
    ("words", "named"),
    [(["--clean", "missing"], "missing: no such folder"), (["."], ""), (["here"], "--clean")],
)
def test_folders_that_do_not_fit(
    words: list[str],
    named: str,
    here: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(here.parent)
    monkeypatch.setattr("evaluation.setup.doctor.examine", list)
    with pytest.raises(SystemExit) as ended:
        cli.main(["doctor", *words])
    assert (ended.value.code or 0) == (2 if named else 0)
    assert named in capsys.readouterr().err
