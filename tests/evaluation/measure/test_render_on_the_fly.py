"""What is measured on images that are drawn on the fly is what is measured on a recording."""

from dataclasses import replace
from pathlib import Path

import pytest

from airground.config import Config
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.experiment import Task, run_task
from evaluation.setup.setups import Setup
from evaluation.table.rows import CLOCK_STAGES, Row
from sim.recording.recorder import record
from sim.recording.rendered import Flight
from sim.scene import parse_scene
from sim.sensors.presets import NOMINAL
from tests.sim.small_flight import SCENE


def measured(rows: list[Row]) -> list[str]:
    """All that must agree, in words, for a missing value is not equal to itself."""
    return [repr(row) for row in rows if row.stage not in CLOCK_STAGES]


@pytest.mark.slow
def test_results_are_those_from_disk(tmp_path: Path) -> None:
    scene = parse_scene(SCENE, "small.toml").model_copy(update={"duration_s": 7.0})
    flight = Flight(scene, 3, 0, NOMINAL)
    path = record(scene, 3, NOMINAL, tmp_path / "recording", workers=1)
    setups = [Setup(Config(), "oracle")]
    task = Task(path, 3, 0, setups, Protocol(1, 2), negatives=True, stranger=path)
    stored = run_task(task)
    drawn = run_task(replace(task, recording=flight, stranger=flight))
    for stage in ("surface", "no_overlap", "wrong_map"):
        assert len([row for row in stored.rows if row.stage == stage]) > 0
    assert measured(drawn.rows) == measured(stored.rows)
