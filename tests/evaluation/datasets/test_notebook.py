"""The example notebook runs from top to bottom, and what it computes is right."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

from tests.sources import ROOT

NOTEBOOK = ROOT / "docs" / "load_a_recording.ipynb"
LIBRARIES = {"tomllib", "pathlib", "cv2", "matplotlib.pyplot", "numpy", "open3d"}


def cells() -> list[dict[str, Any]]:
    notebook = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    assert notebook["nbformat"] == 4
    return notebook["cells"]


def test_it_stores_no_outputs_and_needs_no_other_library() -> None:
    code = [cell for cell in cells() if cell["cell_type"] == "code"]
    assert len(code) >= 6
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code)
    lines = [line for cell in code for line in "".join(cell["source"]).splitlines()]
    words = [line.split() for line in lines if line.startswith(("import ", "from "))]
    assert {word[1] for word in words} == LIBRARIES


def test_its_cells_run_in_order(
    small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "recordings").mkdir()
    (tmp_path / "recordings" / "a").symlink_to(small)
    monkeypatch.chdir(tmp_path)
    mpl.use("Agg")
    found: dict[str, Any] = {}
    for cell in cells():
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), cell["id"], "exec"), found)
    assert found["rate_hz"] == pytest.approx(200, rel=0.01)
    assert found["gravity_m_s2"] == pytest.approx(9.81, abs=0.2)
    assert len(found["corners"]) > 50
    assert len(found["error_m"]) > 2000
    assert np.median(found["error_m"]) < 0.02  # noise of depth, and the nominal calibration
