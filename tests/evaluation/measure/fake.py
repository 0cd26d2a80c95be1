"""Fake units: their results depend on the seed alone, and each call leaves a trace file."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from airground.config import Config
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.measure import Group, Refused
from evaluation.measure.work.unit import Finished, Unit
from evaluation.setup.setups import Setup, with_localization
from evaluation.table.rows import ResultTable, Row

DIE_ONCE, DIE, REFUSE, PAUSE_S = "die_once", "die", "refuse", "pause_s"
"""Files in a unit's folder that say what is to happen in it."""
RUNS = "runs"
"""Has a byte for each time that a unit was run."""


def fake_units(folder: Path, count: int, pause_s: float = 0.0) -> list[Unit]:
    """Two variants of localization on each of `count` flights, whose folders are made here."""
    units = []
    for seed in range(count):
        flight = folder / f"flight_{seed}"
        flight.mkdir(parents=True, exist_ok=True)
        (flight / "recording.toml").write_text(f"seed = {seed}\n")
        (flight / PAUSE_S).write_text(str(pause_s))
        for particles in (50, 200):
            setup = Setup(with_localization(Config(), particles=particles))
            units.append(Unit(flight, seed, 0, setup, Protocol()))
    return units


def runs(folder: Path) -> list[int]:
    """How often each flight was run."""
    files = sorted(folder.glob("flight_*"), key=lambda file: int(file.name.rpartition("_")[2]))
    return [(file / RUNS).stat().st_size if (file / RUNS).exists() else 0 for file in files]


def work(group: Group) -> list[Finished] | Refused:
    """In place of `evaluation.measure.work.measure.work`."""
    first = group.units[0]
    assert isinstance(first.recording, Path)
    with (first.recording / RUNS).open("ab") as file:
        file.write(b"x")
    time.sleep(float((first.recording / PAUSE_S).read_text()))
    once = first.recording / DIE_ONCE
    if once.exists():
        once.unlink()
        os.kill(os.getpid(), signal.SIGKILL)
    if (first.recording / DIE).exists():
        os.kill(os.getpid(), signal.SIGKILL)
    if (first.recording / REFUSE).exists():
        return Refused(f"flight {first.seed} is impossible")
    finished = []
    for unit in group.units:
        value = unit.seed + unit.setup.config.localization.particles / 1000
        condition = unit.setup.condition("none")
        place = {"sequence": 0, "iteration": 1}
        row = Row("tiny", unit.seed, 0, condition, "localization", "error_m", value, "m", **place)
        finished.append(Finished(ResultTable.from_rows([row])))
    return finished
