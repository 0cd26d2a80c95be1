"""The paper's protocol: scenes x flights, recorded, mapped, localized, refined."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path

from rich.progress import track

from evaluation.environment import usable_cores
from evaluation.experiment import Protocol, Task, run_task
from evaluation.results import ResultTable, Row
from evaluation.setups import Setup, grouped_by_maps
from evaluation.showcase import Showcase
from evaluation.workers import outcomes
from sim.presets import SensorPreset
from sim.recorder import record
from sim.rendered import Flight
from sim.scene import Scene

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Plan:
    """What to reproduce.

    Attributes:
        scenes: Which worlds.
        flights: How many flights over each.
        setups: What to measure, the primary setup first.
        sensors: How good the sensors are.
        protocol: How much is measured on each recording.
        seed: Draws the heaps, the flights, the noise and the particles.
        budget: Whether to measure what each stage of the primary setup loses.
    """

    scenes: list[Scene]
    flights: int
    setups: list[Setup]
    sensors: SensorPreset
    protocol: Protocol
    seed: int
    budget: bool = False


@dataclass(frozen=True)
class Findings:
    """Everything that was measured, and what pictures are drawn from."""

    table: ResultTable
    showcase: Showcase | None


def reproduce(plan: Plan, recordings: Path | None, workers: int | None = None) -> Findings:
    """Record what is not there yet, and measure all of it.

    Args:
        plan: What to do.
        recordings: Folder of the recordings; those in it with the right name are used. None
            keeps none: images are drawn while they are measured, once more for each pass.
        workers: Processes at a time; None for one a core. The result does not depend on it.
    """
    tasks: list[Task] = []
    for scene in plan.scenes:
        for flight in range(plan.flights):
            what = Flight(scene, plan.seed, flight, plan.sensors)
            recording = what if recordings is None else _recorded(what, recordings, workers)
            for setups in grouped_by_maps(plan.setups):
                tasks.append(
                    Task(
                        recording,
                        plan.seed,
                        flight,
                        setups,
                        plan.protocol,
                        showcase=not tasks,
                        budget=plan.budget and setups[0] is plan.setups[0],
                        baselines=setups[0] is plan.setups[0],
                    )
                )
    workers = workers or usable_cores()
    renderers = max(1, workers // len(tasks)) if tasks else 1
    return _measured([replace(task, renderers=renderers) for task in tasks], workers)


def _recorded(flight: Flight, folder: Path, workers: int | None) -> Path:
    """The recording of one flight, made if it is not there yet."""
    name = f"{flight.scene.name}_{flight.sensors.name}_seed{flight.seed}_flight{flight.flight}"
    path = folder / name
    if path.exists():
        log.info("using the recording %s", path)
    else:
        folder.mkdir(parents=True, exist_ok=True)
        what = flight.scene, flight.seed, flight.sensors
        record(*what, path, workers=workers, flight=flight.flight)
    return path


def _measured(tasks: list[Task], workers: int) -> Findings:
    """The tasks' outcomes, in the order of the tasks whatever the order of finishing."""
    rows: list[Row] = []
    showcase: Showcase | None = None
    for outcome in track(outcomes(run_task, tasks, workers), "measuring", total=len(tasks)):
        rows += outcome.rows
        showcase = showcase or outcome.showcase
    return Findings(ResultTable.from_rows(rows), showcase)
