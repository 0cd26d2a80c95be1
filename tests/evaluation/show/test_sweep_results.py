"""What a sweep writes: the rows with their dials, readings with intervals, figures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from airground.config import Config
from evaluation.judge import sweep as module
from evaluation.judge.sweep import Measured, sweep
from evaluation.measure.plans.sweep import SweepPlan, parse_vary
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.unit import Finished, Unit, UnitStore
from evaluation.setup.setups import Setup
from evaluation.show.sweep_results import print_sweep, sweep_figure, write_sweep
from evaluation.table.intervals import rate_within
from evaluation.table.rows import ResultTable, Row
from sim.scene import load_scene
from sim.sensors.presets import NOMINAL

SEQUENCES, TRIALS = 5, 8


def plan(*words: str) -> SweepPlan:
    scenes = (load_scene("tiny"),)
    return SweepPlan(parse_vary(words), scenes, 2, Setup(Config()), NOMINAL, Protocol(), 0)


def found(unit: Unit) -> Finished:
    """Made up: more particles, smaller errors; 50 of them lose every other sequence."""
    particles = unit.setup.config.localization.particles
    rng = np.random.default_rng([unit.seed, particles])
    condition = unit.setup.condition("nominal")
    rows = []

    def add(stage: str, metric: str, value: float, **where: int) -> None:
        rows.append(
            Row("tiny", unit.seed, 0, condition, stage, metric, value, "", **where)  # type: ignore[arg-type]
        )

    add("run", "processing_s", rng.random())
    add("timing", "icp", rng.random())
    for sequence in range(SEQUENCES):
        for iteration in range(1, 13):
            lost = particles == 50 and sequence % 2 == 0
            error = float("nan") if lost else rng.random() * 10 / particles
            add("localization", "error_m", error, sequence=sequence, iteration=iteration)
    for trial in range(TRIALS):
        add("refinement", "after_translation_m", rng.random() * 0.06, trial=trial)
        add("refinement", "after_rotation_deg", rng.random(), trial=trial)
        add("refinement", "accepted", 1.0, trial=trial)
    return Finished(ResultTable.from_rows(rows), None)


@pytest.fixture(autouse=True)
def _made_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "measure", lambda units, store, crew: [found(u) for u in units])


def swept(plan: SweepPlan, tmp_path: Path) -> list[Measured]:
    return sweep(plan, UnitStore(tmp_path / "units"), Crew(None, 1, 1, tmp_path))


def test_every_row_says_where_the_dials_stood(tmp_path: Path) -> None:
    sweeping = plan("localization.particles=50,200", "localization.heading=known,search")
    measured = swept(sweeping, tmp_path)
    write_sweep(tmp_path, sweeping, measured)
    table = pd.read_parquet(tmp_path / "results.parquet")
    assert sorted(table["localization.particles"].unique()) == [50.0, 200.0]
    assert set(table["localization.heading"]) == {'"known"', '"search"'}
    assert set(table["seed"]) == {0, 1}
    # Times depend on the machine: a sweep does not keep them.
    assert set(table["stage"]) == {"localization", "refinement"}
    at = (table["localization.particles"] == 50) & (table["localization.heading"] == '"known"')
    assert len(table[at]) == 2 * (12 * SEQUENCES + 3 * TRIALS)


def test_failures_count_and_intervals_are_those_of_the_statistics(tmp_path: Path) -> None:
    measured = swept(plan("localization.particles=50,200"), tmp_path)
    errors = measured[0].table.sequences("error_m")
    rate = rate_within(errors[4], 0.25)
    reading = measured[0].readings["within_0_25_m_fourth"]
    assert (reading.value, reading.low, reading.high) == (rate.share, rate.low, rate.high)
    assert reading.count == 2 * SEQUENCES
    assert reading.value == pytest.approx(0.4)  # three of five are lost
    assert measured[1].readings["within_0_25_m_fourth"].value == 1.0
    median = measured[0].readings["refined_translation_m"]
    assert median.low <= median.value <= median.high
    assert median.count == 2 * TRIALS


def test_the_same_sweep_gives_the_same_bytes(tmp_path: Path) -> None:
    sweeping = plan("localization.particles=50,200")
    made = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write_sweep(tmp_path / name, sweeping, swept(sweeping, tmp_path))
        files = [file for file in (tmp_path / name).rglob("*") if file.is_file()]
        made.append({file.relative_to(tmp_path / name): file.read_bytes() for file in files})
    assert made[0] == made[1]
    assert {str(file) for file in made[0]} == {
        "results.parquet",
        "sweep.json",
        "config.toml",
        "figures/sweep.png",
        "figures/sweep.pdf",
    }
    summary = json.loads(made[0][next(f for f in made[0] if f.name == "sweep.json")])
    assert summary["schema"] == "airground-sweep"
    assert [at["dials"] for at in summary["points"]] == [
        {"localization.particles": 50},
        {"localization.particles": 200},
    ]
    assert summary["dials"][0]["values"] == [50, 200]


def test_the_screen_shows_a_row_a_point(tmp_path: Path) -> None:
    sweeping = plan("localization.particles=50,200")
    console = Console(record=True, width=200)
    print_sweep(sweeping, swept(sweeping, tmp_path), console)
    text = console.export_text()
    assert "particles" in text
    assert "40 %" in text
    assert "100 %" in text
    rate = swept(sweeping, tmp_path)[0].readings["within_0_25_m_fourth"]
    assert f"[{100 * rate.low:.0f}, {100 * rate.high:.0f}]" in text


@pytest.mark.parametrize(
    ("words", "places"),
    [
        (["localization.particles=50,200,800"], [np.log10(v) for v in (50, 200, 800)]),
        (["scene.texture=0,0.5,1"], [0, 0.5, 1]),
        (["localization.heading=known,search"], [0, 1]),
    ],
)
def test_curves_stand_where_their_values_are(
    words: list[str], places: list[float], tmp_path: Path
) -> None:
    sweeping = plan(*words)
    measured = swept(sweeping, tmp_path)
    figure = sweep_figure(sweeping, measured)
    line = figure.axes[1].lines[0]
    np.testing.assert_allclose(line.get_xdata(), places)
    shares = [100 * at.readings["within_0_25_m_fourth"].value for at in measured]
    np.testing.assert_allclose(line.get_ydata(), shares)


def test_other_dials_are_lines_of_their_own(tmp_path: Path) -> None:
    sweeping = plan("localization.particles=50,200", "scene.texture=0.2,0.6,1")
    figure = sweep_figure(sweeping, swept(sweeping, tmp_path))
    assert [len(axes.lines) for axes in figure.axes[:5]] == [3] * 5
    legend = figure.axes[5].get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == [
        f"scene.texture = {value}" for value in (0.2, 0.6, 1)
    ]
