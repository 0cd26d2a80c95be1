"""A new scene and a new baseline, added as the documentation says and with its own code.

The pages' code goes into a copy of `evaluation/`; the command does the rest.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from evaluation.table.rows import ResultTable
from sim.scene import parse_scene

ROOT = Path(__file__).parents[2]
MAX_LINES = 40


def blocks(page: str, language: str) -> list[str]:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


SCENE = blocks("add_a_scene.md", "toml")[-1]
FUNCTION, LINE = blocks("add_a_baseline.md", "python")[:2]


def test_both_are_short() -> None:
    assert len(SCENE.splitlines()) < MAX_LINES
    assert len(FUNCTION.splitlines()) + len(LINE.splitlines()) < MAX_LINES


def test_the_scene_is_one() -> None:
    assert parse_scene(SCENE, "small.toml").name == "small"


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The repository with both added; rooms that stay as they are keep their compiled kernels."""
    root = tmp_path_factory.mktemp("copy")
    for room in ("airground", "sim", "scenes"):
        (root / room).symlink_to(ROOT / room)
    shutil.copytree(ROOT / "evaluation", root / "evaluation")
    (root / "small.toml").write_text(SCENE, encoding="utf-8")
    (root / "evaluation/measure/baselines/highest_heap.py").write_text(FUNCTION, encoding="utf-8")
    table = root / "evaluation/measure/baselines/table.py"
    table.write_text(with_line(table.read_text(encoding="utf-8")), encoding="utf-8")
    return root


def with_line(table: str) -> str:
    """The table with what the page adds to it."""
    (imported,) = re.findall(r"^from .*\n", LINE, re.MULTILINE)
    (added,) = re.findall(r"^    Baseline\(.*\),\n", LINE, re.MULTILINE)
    head = "BASELINES = (\n"
    assert table.count(head) == 1
    return table.replace(head, f"{imported}{head}{added}")


@pytest.mark.slow(minutes=1)
@pytest.mark.subject(but={"airground/slam": "poses are the true ones"})
def test_the_baseline_answers_over_the_scene(copy: Path) -> None:
    command = "from evaluation.cli import main; main()"
    words = "reproduce --scenes small.toml --flights 1 --alone --poses oracle --out heap"
    counts = "--set protocol.sequences_per_flight=1 --set protocol.trials=2"
    counts += " --set protocol.baselines=2"
    done = subprocess.run(
        [sys.executable, "-c", command, *words.split(), *counts.split()],
        cwd=copy,
        env=os.environ | {"PYTHONPATH": str(copy)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    rows = ResultTable.read(copy / "heap" / "results.parquet").frame
    answers = rows[(rows.scene == "small") & (rows.stage == "baseline")]
    errors = answers[answers.metric == "heap_horizontal_m"].value
    assert len(errors) == 2
    assert np.isfinite(errors).all()
    assert (errors < 1.0).all()  # in a square of 6 m
    assert "highest on highest" in (copy / "heap" / "report.html").read_text(encoding="utf-8")
