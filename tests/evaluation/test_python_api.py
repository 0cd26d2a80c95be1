"""The examples of docs/python_api.md and docs/add_a_front_end.md, as they stand there."""

from __future__ import annotations

import ast
import re
import runpy
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import airground
from airground.augmentation import AugmentedMap
from airground.core.cloud import PointCloud
from airground.io.ply import read_ply
from airground.io.recording import Recording

DOCS = Path(__file__).parents[2] / "docs"


def examples_of(page: str) -> list[str]:
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(r"```python\n(.*?)```", text, re.DOTALL)


EXAMPLES = examples_of("python_api.md")
FRONT_END, _, PIPELINE = examples_of("add_a_front_end.md")


@pytest.fixture
def here(small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with recordings/a in it."""
    (tmp_path / "recordings").mkdir()
    (tmp_path / "recordings" / "a").symlink_to(small)
    monkeypatch.chdir(tmp_path)


def names_after(example: str) -> dict[str, Any]:
    """What an example leaves."""
    script = Path("example.py")
    script.write_text(example, encoding="utf-8")
    return runpy.run_path(str(script))


def test_every_example_needs_two_import_lines_at_most() -> None:
    for example in (*EXAMPLES, FRONT_END, PIPELINE):
        imports = [line for line in example.splitlines() if line.startswith(("import", "from"))]
        assert len(imports) <= 2, example


def test_a_recording_gives_events_and_a_map(here: None) -> None:
    names = names_after(EXAMPLES[0])
    assert isinstance(names["map_"], AugmentedMap)
    assert len(names["map_"].cloud_ground) > 1000
    cloud, sources = read_ply(Path("augmented_map.ply"))
    assert sources is not None
    assert len(sources) == len(cloud) == len(names["map_"].cloud_ground)


def test_the_pipeline_takes_every_message(here: None) -> None:
    names = names_after(EXAMPLES[1])
    assert isinstance(names["cloud"], PointCloud)
    assert len(names["cloud"]) > 1000


def test_the_run_is_measured(here: None, small: Path) -> None:
    names = names_after(EXAMPLES[2])
    table = names["table"]
    assert isinstance(table, pd.DataFrame)
    recorded = table[(table.stage == "run") & (table.metric == "recorded_s")]
    assert recorded.value.tolist() == [Recording.open(small).duration_s]
    assert isinstance(names["result"].augmented, AugmentedMap)


def test_each_name_of_the_package_is_that_of_its_module() -> None:
    """What type checkers read is what programs get."""
    tree = ast.parse(Path(airground.__file__).read_text(encoding="utf-8"))
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module]
    stated = {
        alias.name: node.module
        for node in imports
        if node.module.startswith("airground.")
        for alias in node.names
    }
    assert stated == airground._MODULE_OF
    for name, module in stated.items():
        assert getattr(airground, name) is getattr(import_module(module), name)
        assert f"`{name}`" in airground.__doc__
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = airground.nothing


def test_the_package_alone_loads_nothing_heavy() -> None:
    heavy = "{'numpy', 'numba', 'open3d', 'pandas'}"
    code = f"import airground, sys; print(sorted({heavy} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_front_end_of_your_own_runs_in_the_pipeline(here: None) -> None:
    names = names_after(FRONT_END + PIPELINE)
    tracked = [airground.MavTracked, airground.GroundTracked]
    images = [len(names["robots"].of(robot).camera_stamps) for robot in airground.Source]
    counts = [sum(isinstance(event, kind) for event in names["events"]) for kind in tracked]
    assert sorted(counts) == sorted(images)
    assert names["trackers"].finish() is not None
