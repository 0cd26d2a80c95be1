"""The fast suite: fixed, small, meant to run on every change.

It has many short flights over different heaps instead of one long flight, since only flights are
independent. With all metrics watched (`judge.verdict`), ten flights are the fewest that can give
a verdict, and only if all agree; with twelve, one may differ a little.
"""

from __future__ import annotations

from dataclasses import dataclass

from evaluation.measure.plans.reproduce import Plan
from evaluation.measure.protocol.trials import Protocol
from evaluation.setup.setups import Setup
from sim.recording.recorder import Flight
from sim.scene import load_scene
from sim.sensors.presets import SensorPreset

SEEDS_APART = 100
"""Seed n of the suite draws heaps n * 100, n * 100 + 1, ...: other seeds give other heaps."""


@dataclass(frozen=True)
class Flights:
    """Some flights over one scene, each over a heap of its own and cut after `duration_s`."""

    scene: str
    count: int
    duration_s: float


@dataclass(frozen=True)
class Suite:
    """Flights, and the extent of the measurements on each."""

    flights: tuple[Flights, ...]
    protocol: Protocol

    def plan(self, setup: Setup, sensors: SensorPreset, seed: int) -> Plan:
        """The plan that measures one setup; `seed` is that of heaps, flights, noise and
        particles."""
        flights = [
            Flight(
                load_scene(flights.scene),
                SEEDS_APART * seed + index,
                0,
                sensors,
                flights.duration_s,
            )
            for flights in self.flights
            for index in range(flights.count)
        ]
        return Plan(flights, [setup], self.protocol, negatives=False)


SUITES = {
    "fast": Suite(
        # `flat` holds nothing to find: every claimed position there is wrong.
        (Flights("tiny", 12, 20.0), Flights("flat", 1, 24.0)),
        # Verdicts look at aerial maps 1 and 4.
        Protocol(sequences=3, trials=4, sequence_length=4, wide_searches=6),
    ),
}
