"""A run that opens at a moment: a clock that begins there, with what was last set before."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from rerun.chunk import RrdReader

from evaluation import cli
from evaluation.setup import console
from evaluation.show.rerun_view import viewer
from evaluation.show.rerun_view.one_moment import FROM_MOMENT
from evaluation.show.rerun_view.sensor_stream import TIMELINE
from tests.evaluation.show.scripted_run import SECOND, written

AT_S = 2.5


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("moment") / "run.rrd")


def saved(run: Path, at: str, out: Path) -> Path:
    cli.parse("view", [str(run), "--at", at, "--save", str(out)]).main()
    return out


def stamps_ns(file: Path, entity: str, clock: str) -> list[int]:
    """Stamps of an entity's rows on a timeline, in order."""
    found: list[int] = []
    for chunk in RrdReader(file).stream().filter(content=entity):
        batch = chunk.to_record_batch()
        if clock in batch.schema.names:
            column = batch.column(clock).drop_null()
            found += column.cast(pa.int64()).to_pylist()
    return sorted(found)


def test_a_clock_begins_at_the_moment_with_all_that_was_set_before(
    run: Path, tmp_path: Path
) -> None:
    file = saved(run, f"{AT_S}", tmp_path / "moment.rrd")
    viewer.verify(file)
    pose = "/mav/camera"
    before = stamps_ns(run, pose, TIMELINE)
    assert before[0] < AT_S * SECOND < before[-1]
    assert stamps_ns(file, pose, TIMELINE) == before
    held = stamps_ns(file, pose, FROM_MOMENT)
    assert held == np.maximum(before, round(AT_S * SECOND)).tolist()


def test_curves_of_before_do_not_lie_at_its_beginning(run: Path, tmp_path: Path) -> None:
    file = saved(run, f"{AT_S}", tmp_path / "moment.rrd")
    corners = "/curves/corners/mav"
    before = stamps_ns(run, corners, TIMELINE)
    assert stamps_ns(file, corners, TIMELINE) == before
    after = [stamp for stamp in before if stamp >= AT_S * SECOND]
    assert 0 < len(after) < len(before)
    assert stamps_ns(file, corners, FROM_MOMENT) == after


@pytest.mark.parametrize("at", ["-3", "99", "nan"])
def test_a_moment_that_the_run_has_not_is_refused(
    run: Path, at: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(["view", str(run), "--at", at, "--save", str(tmp_path / "moment.rrd")])
    assert ended.value.code == console.EXIT_ERROR
    (line,) = capsys.readouterr().err.splitlines()
    assert f"--at {float(at):g}" in line
    assert "from 0" in line
    assert list(tmp_path.iterdir()) == []


def test_two_runs_have_a_moment_of_their_own(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = tmp_path / "other.rrd"
    other.write_bytes(run.read_bytes())
    with pytest.raises(SystemExit) as ended:
        cli.main(["view", str(run), str(other), "--at", "1", "--save", str(tmp_path / "x.rrd")])
    assert ended.value.code == console.EXIT_ERROR
    assert "--at is for one run" in capsys.readouterr().err
