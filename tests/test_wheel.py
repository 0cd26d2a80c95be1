"""What we hand out works where our checkout is not."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from a copy of the sources."""
    source = tmp_path_factory.mktemp("source") / "airground"
    keep_out = shutil.ignore_patterns(".*", "results", "recordings", "__pycache__", "build", "dist")
    shutil.copytree(ROOT, source, ignore=keep_out)
    out = tmp_path_factory.mktemp("dist")
    pip = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
    options = ["--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", str(out)]
    subprocess.run([*pip, "wheel", *options, str(source)], check=True)
    (built,) = out.glob("*.whl")
    return built


@pytest.mark.slow
@pytest.mark.subject(
    "pyproject.toml",
    "README.md",
    "LICENSE",
    "scenes",
    "sim/scene",
    "evaluation/cli.py",
    "evaluation/show/report",
    "evaluation/accepted.json",
)
def test_the_wheel_holds_what_it_needs_and_no_more(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    rooms = {name.partition("/")[0] for name in names if ".dist-info/" not in name}
    assert rooms == {"airground", "evaluation", "scenes", "sim"}
    assert {f"scenes/{scene.name}" for scene in (ROOT / "scenes").glob("*.toml")} <= set(names)
    assert {"evaluation/show/report/report.html.j2", "evaluation/accepted.json"} <= set(names)
    assert not any("__pycache__" in name for name in names)


@pytest.mark.slow
@pytest.mark.subject(
    "pyproject.toml",
    "README.md",
    "LICENSE",
    "scenes",
    "sim/scene",
    "evaluation/cli.py",
    "evaluation/show/report",
    "evaluation/accepted.json",
)
def test_the_wheel_works_outside_the_checkout(wheel: Path, tmp_path: Path) -> None:
    environment = tmp_path / "venv"
    venv.create(environment, with_pip=False)
    python = environment / "bin" / "python"
    (site,) = environment.glob("lib/python*/site-packages")
    # The libraries come from this environment, ours from the wheel alone.
    zipfile.ZipFile(wheel).extractall(site)
    others = [p for p in sys.path if p.endswith("site-packages")]
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def run(script: str) -> str:
        done = subprocess.run(
            [str(python), "-c", f"import sys; sys.path += {others!r}\n{script}"],
            cwd=tmp_path,
            env=clean,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    where = run("import airground, sim, evaluation; print(airground.__file__)")
    assert str(tmp_path) in where
    assert "usage: airground" in run("sys.argv = ['airground', '-h']\n" + ENTRY)
    scenes = run("from sim.scene import scene_names, load_scene\nprint(*scene_names())").split()
    assert scenes == sorted(file.stem for file in (ROOT / "scenes").glob("*.toml"))
    for scene in scenes:
        run(f"from sim.scene import load_scene; print(load_scene({scene!r}).name)")


ENTRY = "from evaluation.cli import main; main()"
