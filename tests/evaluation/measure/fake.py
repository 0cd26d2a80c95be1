"""Fake units: their results depend on the seed alone, and each call leaves a trace file."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from airground.config import Config
from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.measure import Refused, Task, ToRecord
from evaluation.measure.work.unit import Finished, Unit
from evaluation.setup.setups import Setup, with_localization
from evaluation.table.rows import ResultTable, Row
from sim.recording.recorder import Flight
from sim.scene import load_scene
from sim.sensors.presets import NONE

DIE_ONCE, DIE, REFUSE, PAUSE_S = "die_once", "die", "refuse", "pause_s"
"""Files in a unit's folder that say what is to happen in it."""
RUNS = "runs"
"""Has a byte for each time that a unit was run."""
WAIT_S = 60
"""Longest wait of a recording for the unit of another one [s]."""


def fake_units(folder: Path, count: int, pause_s: float = 0.0) -> list[Unit]:
    """Two variants of localization on each of `count` flights, whose folders are made here."""
    for path in fake_flights(folder, count):
        make_recording(path, pause_s)
    return units_of(fake_flights(folder, count))


def fake_flights(folder: Path, count: int) -> dict[Path, Flight]:
    """Flights by the path of their recording."""
    scene = load_scene("tiny")
    return {folder / f"flight_{seed}": Flight(scene, seed, 0, NONE) for seed in range(count)}


def units_of(flights: dict[Path, Flight]) -> list[Unit]:
    """Two variants of localization on each flight."""
    setups = [Setup(with_localization(Config(), particles=count)) for count in (50, 200)]
    return [
        Unit(path, flight.seed, 0, setup, Protocol())
        for path, flight in flights.items()
        for setup in setups
    ]


def make_recording(path: Path, pause_s: float = 0.0) -> None:
    path.mkdir(parents=True, exist_ok=True)
    (path / "recording.toml").write_text(f'name = "{path.name}"\n')
    (path / PAUSE_S).write_text(str(pause_s))


def waiting_for(path: Path) -> Path:
    """The file that names the recording whose unit is to be measured before this one is made."""
    return path.with_suffix(".waits")


def refused(path: Path) -> Path:
    """The file that says that a recording is refused."""
    return path.with_suffix(".refused")


def runs(folder: Path) -> list[int]:
    """How often each flight was run."""
    files = sorted(folder.glob("flight_*/"), key=lambda file: int(file.name.rpartition("_")[2]))
    return [(file / RUNS).stat().st_size if (file / RUNS).exists() else 0 for file in files]


def work(task: Task) -> list[Finished] | Refused:
    """In place of `evaluation.measure.work.measure.work`."""
    if isinstance(task, ToRecord):
        return record(task.path)
    first = task.units[0]
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
    if isinstance(first.stranger, Path) and not first.stranger.exists():
        return Refused(f"{first.stranger.name} is not recorded yet")
    if (first.recording / REFUSE).exists():
        return Refused(f"flight {first.seed} is impossible")
    finished = []
    for unit in task.units:
        value = unit.seed + unit.setup.config.localization.particles / 1000
        condition = unit.setup.condition("none")
        place = {"sequence": 0, "iteration": 1}
        row = Row("tiny", unit.seed, 0, condition, "localization", "error_m", value, "m", **place)
        finished.append(Finished(ResultTable.from_rows([row])))
    return finished


def record(path: Path) -> list[Finished] | Refused:
    """Make a recording; called in a worker."""
    if refused(path).exists():
        return Refused(f"{path.name} is impossible")
    if waiting_for(path).exists():
        other = path.parent / waiting_for(path).read_text()
        deadline = time.monotonic() + WAIT_S
        while not (other / RUNS).exists():
            if time.monotonic() > deadline:
                return Refused(f"{other.name} was not measured meanwhile")
            time.sleep(0.05)
    make_recording(path)
    return []
