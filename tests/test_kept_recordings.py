"""`scripts/kept_recordings`: recordings serve until the simulator changes."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "scripts/kept_recordings"
SIMULATOR = ("scenes", "sim", "airground/core", "airground/io")


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A copy of the script among files that stand for the simulator's."""
    root = tmp_path / "project"
    for name in ("scripts", *SIMULATOR):
        (root / name).mkdir(parents=True)
        (root / name / "file.py").write_text(name)
    (root / "requirements.lock").write_text("")
    shutil.copy(SCRIPT, root / "scripts")
    return root


def kept(project: Path, free_gib: int = 100) -> Path | None:
    """What the script answers on a disk with so much room."""
    tools = project.parent / "tools"
    tools.mkdir(exist_ok=True)
    (tools / "df").write_text(f"#!/bin/sh\necho Avail\necho ' {free_gib}G'\n")
    (tools / "df").chmod(0o755)
    done = subprocess.run(
        [project / "scripts/kept_recordings", "results"],
        env=os.environ | {"PATH": f"{tools}:{os.environ['PATH']}"},
        cwd=project,
        capture_output=True,
        text=True,
        check=True,
    )
    return Path(done.stdout.strip()) if done.stdout.strip() else None


def test_the_folder_stays_while_the_simulator_does(project: Path) -> None:
    first = kept(project)
    assert first is not None
    assert first.parent == project / "results"
    first.mkdir()
    (project / "sim/__pycache__").mkdir()
    (project / "sim/__pycache__/file.pyc").write_text("compiled")
    (project / "scripts/other").write_text("no part of the simulator")
    assert kept(project) == first
    assert first.exists()


@pytest.mark.parametrize("name", [*(f"{name}/file.py" for name in SIMULATOR), "requirements.lock"])
def test_a_change_of_the_simulator_removes_what_it_recorded(project: Path, name: str) -> None:
    first = kept(project)
    assert first is not None
    first.mkdir()
    own = [project / "results" / name for name in ("regression", "recordings-of-my-robot")]
    for folder in own:
        folder.mkdir()
    (project / name).write_text("changed")
    second = kept(project)
    assert second is not None
    assert second != first
    assert not first.exists()
    assert all(folder.exists() for folder in own)


def test_a_full_disk_keeps_none_but_uses_what_is_there(project: Path) -> None:
    assert kept(project, free_gib=35) is None
    first = kept(project, free_gib=36)
    assert first is not None
    first.mkdir()
    assert kept(project, free_gib=0) == first
