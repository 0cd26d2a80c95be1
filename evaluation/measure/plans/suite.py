"""The fast suite: fixed, small, meant to run on every change.

Many short flights over different heaps, not one long one: flights are what is independent.
Ten of them are the fewest that can say anything with all metrics watched (`verdict`), and
only if all agree; of twelve, one may move a little the other way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.measure import measure
from evaluation.measure.work.recordings import recorded
from evaluation.measure.work.unit import Finished, Unit, UnitStore
from evaluation.setup.setups import Setup
from sim.recording.rendered import Flight
from sim.scene import load_scene
from sim.sensors.presets import SensorPreset

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
        Protocol(sequences=3, trials=4, sequence_length=4, wide_searches=6),
    ),
}


@dataclass(frozen=True)
class SuitePlan:
    """A suite to be flown.

    Attributes:
        suite: What to fly.
        setup: What to measure.
        sensors: How good the sensors are.
        seed: Of the heaps, the flights, the noise and the particles.
    """

    suite: Suite
    setup: Setup
    sensors: SensorPreset
    seed: int

    def flights(self) -> list[Flight]:
        """All flights in their order, each over a heap of its own."""
        return [
            Flight(
                load_scene(flights.scene),
                SEEDS_APART * self.seed + index,
                0,
                self.sensors,
                flights.duration_s,
            )
            for flights in self.suite.flights
            for index in range(flights.count)
        ]

    def tasks(self) -> int:
        """How many tasks they make."""
        return sum(flights.count for flights in self.suite.flights)

    def measured(self, recordings: Path | None, store: UnitStore, crew: Crew) -> Finished:
        """Record what is not there yet, and measure one setup.

        Args:
            recordings: Folder of the recordings; those in it with the right name are used. None
                keeps none.
            store: Has the units that an earlier run finished, and takes those of this one.
            crew: Does the work; the result does not depend on it.
        """
        flights = self.flights()
        made: Sequence[Path | Flight] = flights
        if recordings is not None:
            made = recorded(flights, recordings, crew)
        units = [
            Unit(
                recording,
                flight.seed,
                flight.flight,
                self.setup,
                self.suite.protocol,
                showcase=flight is flights[0],
            )
            for flight, recording in zip(flights, made, strict=True)
        ]
        return Finished.merged(measure(units, store, crew))
