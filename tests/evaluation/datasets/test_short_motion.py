"""A recording that is longer than the motion in its truth."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from evaluation import cli
from evaluation.setup import console
from sim.robots.motion import STEP_NS, Motion
from tests.evaluation.conftest import FIRST_NS
from tests.fuzz.folders import first_samples

END_NS = FIRST_NS + 200_000_000
"""Seven of the 21 images are before it."""


@pytest.fixture(scope="module")
def short(small: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("short") / "recording"
    shutil.copytree(small, path)
    motion = path / "truth" / "motion.npz"
    first_samples(Motion.load(motion), END_NS // STEP_NS + 1).save(motion)
    return path


@pytest.mark.parametrize(
    "words",
    ["render --add depth", "render --add lidar", "export --format tum", "run --poses oracle"],
)
def test_one_line_names_the_truth_and_nothing_is_left(
    words: str, short: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    verb, *rest = words.split()
    with pytest.raises(SystemExit) as ended:
        cli.main([verb, str(short), *rest, "--out", str(tmp_path / "out")])
    assert ended.value.code == console.EXIT_ERROR
    errors = [line for line in capsys.readouterr().err.splitlines() if "airground: error" in line]
    assert len(errors) == 1
    assert errors[0].startswith(f"airground: error: {short / 'truth'}: no true pose of the mav: ")
    assert errors[0].endswith(f"is outside the motion [0, {END_NS}]")
    assert list(tmp_path.iterdir()) == []
