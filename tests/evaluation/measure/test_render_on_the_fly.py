"""Results on images rendered on the fly equal those on a recording on disk."""

from dataclasses import replace
from pathlib import Path

import pytest

from airground.config import Config
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.experiment import measure_units
from evaluation.measure.work.unit import Finished, Unit
from evaluation.setup.setups import Setup
from evaluation.table.rows import CLOCK_STAGES
from sim.recording.recorder import Flight, record
from sim.scene import parse_scene
from sim.sensors.presets import NOMINAL
from tests.sim.small_flight import SCENE


def measured(finished: Finished) -> list[str]:
    """All that must agree, as text, since a missing value is not equal to itself."""
    return [repr(row) for row in finished.table.without(CLOCK_STAGES).frame.itertuples()]


@pytest.mark.slow
@pytest.mark.subject(but={"airground/slam": "poses are the true ones"})
def test_results_equal_those_from_disk(tmp_path: Path) -> None:
    scene = parse_scene(SCENE, "small.toml").model_copy(update={"duration_s": 7.0})
    flight = Flight(scene, 3, 0, NOMINAL)
    path = record(scene, 3, NOMINAL, tmp_path / "recording", workers=1)
    setup = Setup(Config(), "oracle")
    unit = Unit(path, 3, 0, setup, Protocol(1, 2), negatives=True, stranger=path)
    [stored] = measure_units([unit], renderers=1)
    [drawn] = measure_units([replace(unit, recording=flight, stranger=flight)], renderers=1)
    for stage in ("surface", "no_overlap", "wrong_map"):
        assert (stored.table.frame["stage"] == stage).any()
    assert measured(drawn) == measured(stored)
