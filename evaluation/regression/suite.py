"""The fast suite: fixed, small, meant to run on every change.

Many short flights over different heaps, not one long one: flights are what is independent.
Ten of them are the fewest that can say anything with all metrics watched (`verdict`), and
only if all agree; of twelve, one may move a little the other way.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rich.progress import track

from evaluation.environment import usable_cores
from evaluation.experiment import Outcome, Protocol, Task, run_task
from evaluation.reproduce import Findings
from evaluation.results import ResultTable
from evaluation.setups import Setup
from evaluation.workers import outcomes
from sim.presets import sensor_preset
from sim.recorder import record
from sim.scene import load_scene

SEEDS_APART = 100
"""Seed n of the suite draws heaps n * 100, n * 100 + 1, ...: other seeds, other heaps."""


@dataclass(frozen=True)
class Flights:
    """Some flights over one scene, each over a heap of its own.

    Attributes:
        scene: Its name.
        count: How many.
        duration_s: Of each recording; the scene's flight is cut there.
    """

    scene: str
    count: int
    duration_s: float


@dataclass(frozen=True)
class Suite:
    """What is flown, and what is measured on each flight."""

    flights: tuple[Flights, ...]
    protocol: Protocol


SUITES = {
    "fast": Suite(
        # `flat` holds nothing to find: whoever claims a place there is wrong.
        (Flights("tiny", 12, 20.0), Flights("flat", 1, 24.0)),
        # Verdicts look at aerial maps 1 and 4.
        Protocol(sequences=3, trials=4, sequence_length=4),
    ),
}


@dataclass(frozen=True)
class Flown:
    """One flight of a suite, to be recorded and measured in one process."""

    scene: str
    seed: int
    duration_s: float
    sensors: str
    recording: Path
    setup: Setup
    protocol: Protocol
    showcase: bool


def run_suite(
    suite: Suite,
    setup: Setup,
    sensors: str,
    seed: int,
    recordings: Path,
    workers: int | None = None,
) -> Findings:
    """Record what is not there yet, and measure one setup.

    Args:
        suite: What to fly.
        setup: What to measure.
        sensors: How good the sensors are.
        seed: Of the heaps, the flights, the noise and the particles.
        recordings: Folder of the recordings; those in it with the right name are used.
        workers: Processes at a time; None for one a core. The result does not depend on it.
    """
    flown = [
        Flown(
            scene=flights.scene,
            seed=SEEDS_APART * seed + index,
            duration_s=flights.duration_s,
            sensors=sensors,
            recording=recordings / f"{flights.scene}_{sensors}_seed{SEEDS_APART * seed + index}"
            f"_{flights.duration_s:g}s",
            setup=setup,
            protocol=suite.protocol,
            showcase=flights is suite.flights[0] and index == 0,
        )
        for flights in suite.flights
        for index in range(flights.count)
    ]
    recordings.mkdir(parents=True, exist_ok=True)
    made = outcomes(fly, flown, workers or usable_cores())
    found = list(track(made, "recording and measuring", total=len(flown)))
    rows = [row for outcome in found for row in outcome.rows]
    return Findings(ResultTable.from_rows(rows), found[0].showcase)


def fly(flown: Flown) -> Outcome:
    """Record one flight, unless that was done before, and measure it."""
    if not flown.recording.exists():
        record(
            load_scene(flown.scene),
            flown.seed,
            sensor_preset(flown.sensors),
            flown.recording,
            flown.duration_s,
            workers=1,
            quiet=True,
        )
    task = Task(
        flown.recording, flown.seed, 0, [flown.setup], flown.protocol, showcase=flown.showcase
    )
    return run_task(task)
