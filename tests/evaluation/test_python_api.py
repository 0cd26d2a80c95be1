"""The examples of docs/python_api.md, as they stand there."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from airground.augmentation import AugmentedMap
from airground.core.cloud import PointCloud

PAGE = Path(__file__).parents[2] / "docs" / "python_api.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


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


def test_the_run_is_measured(here: None) -> None:
    names = names_after(EXAMPLES[0])
    table = names["table"]
    assert isinstance(table, pd.DataFrame)
    recorded = table[(table.stage == "run") & (table.metric == "recorded_s")]
    assert recorded.value.tolist() == [names["recording"].duration_s]
    assert isinstance(names["result"].augmented, AugmentedMap)


def test_the_pipeline_takes_every_message(here: None) -> None:
    names = names_after(EXAMPLES[1])
    assert isinstance(names["cloud"], PointCloud)
    assert len(names["cloud"]) > 1000
