"""The protocol and `run` give the same numbers: same pipeline, same random numbers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from airground.config import Config
from airground.io.recording import Recording
from evaluation.measure.protocol.mapping_pass import localize_again, map_recording
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.experiment import REPEATED, measure_units
from evaluation.measure.work.unit import Unit
from evaluation.run.recording import run_recording
from evaluation.setup.setups import Setup, with_localization
from evaluation.table.rows import ResultTable
from sim.recording.recorder import record
from sim.recording.truth import Truth
from sim.scene import load_scene
from sim.sensors.presets import NOMINAL

LENGTH = 3


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("one_pipeline") / "tiny"
    return record(load_scene("tiny"), 0, NOMINAL, folder, 20.0)


def values(table: ResultTable, stage: str, number: int | None = None) -> list[tuple[object, ...]]:
    """Rows of a stage, without notes, in their order."""
    frame = table.frame[table.frame["stage"] == stage]
    frame = frame[frame["note"] != "no position was claimed"]
    frame = frame.assign(trial=frame["trial"].rank(method="dense"))
    if number is not None:
        frame = frame[(frame["sequence"] == number) & (frame["iteration"] <= LENGTH)]
    keys = ["metric", "iteration", "trial", "time_s", "value"]
    return [tuple(map(str, row)) for row in frame[keys].itertuples(index=False)]


@pytest.mark.slow(minutes=1)
@pytest.mark.subject(but={"airground/slam": "both runs have the same"})
def test_run_and_protocol_give_the_same_numbers(path: Path) -> None:
    setup = Setup(Config())
    protocol = Protocol(sequences=2, trials=1, sequence_length=LENGTH)
    [finished] = measure_units([Unit(path, 0, 0, setup, protocol)], renderers=1)
    run = run_recording(Recording.open(path), Truth.open(path), setup, seed=0).table

    assert values(finished.table, "trajectory") == values(run, "trajectory")
    assert len(values(run, "localization", 0)) == 5 * LENGTH
    assert values(finished.table, "localization", 0) == values(run, "localization", 0)
    assert values(finished.table, "alignment")
    assert values(finished.table, "alignment") == values(run, "refinement")

    error = finished.table.frame[finished.table.frame["metric"] == "error_m"]
    origin = error[error["stage"] == "localization"].groupby("sequence")["note"].unique()
    assert [list(notes) for notes in origin] == [[""], [REPEATED]]


@pytest.mark.slow
@pytest.mark.subject(but={"airground/slam": "both runs have the same"})
def test_setups_that_share_maps_give_the_results_of_a_pass_of_their_own(path: Path) -> None:
    recording, truth = Recording.open(path), Truth.open(path)
    few = Setup(with_localization(Config(), particles=50))
    maps = map_recording(recording, truth, Setup(Config()), 0)
    again = localize_again(maps, recording, few, 0, 0)
    own = map_recording(recording, truth, replace(few), 0).localized
    assert len(again.beliefs) == len(own.beliefs) == len(maps.sightings)
    for one, other in zip(again.beliefs, own.beliefs, strict=True):
        assert one.particles.tobytes() == other.particles.tobytes()
    for first, second in zip(again.alignments, own.alignments, strict=True):
        assert (first is None) == (second is None)
        if first is not None and second is not None:
            assert first.T_ground_mav.matrix().tobytes() == second.T_ground_mav.matrix().tobytes()
