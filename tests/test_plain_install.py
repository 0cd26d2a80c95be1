"""`pip install .` works without the lock, with whatever versions the resolver takes today."""

from __future__ import annotations

import os
import shutil
import subprocess
import venv
from pathlib import Path

import pytest

from tests.sources import ROOT


@pytest.mark.slow(minutes=6)
@pytest.mark.subject(
    "pyproject.toml",
    "requirements.lock",
    "sim/recording/render.py",
    "evaluation/setup/doctor.py",
    "evaluation/setup/environment.py",
    "evaluation/show/figures/scene_pictures.py",
)
def test_a_plain_install_renders_and_reproduces(tmp_path: Path) -> None:
    source, environment = tmp_path / "source", tmp_path / "venv"
    keep_out = shutil.ignore_patterns(".*", "results", "recordings", "__pycache__", "build", "dist")
    shutil.copytree(ROOT, source, ignore=keep_out)
    venv.create(environment, with_pip=True)
    binaries = environment / "bin"
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def run(program: str, *words: str) -> str:
        done = subprocess.run(
            [str(binaries / program), *words],
            cwd=tmp_path,
            env={**inherited, "MUJOCO_GL": "egl"},  # as many users of MuJoCo have it
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    run("pip", "install", "--quiet", "--no-compile", "--disable-pip-version-check", str(source))
    assert "Version: 3.1.0\n" in run("pip", "show", "PyOpenGL"), "another pin"
    run("airground", "doctor")
    run("airground", "reproduce", "--quick", "--alone", "--out", "results")
    assert (tmp_path / "results" / "report.html").stat().st_size > 0
