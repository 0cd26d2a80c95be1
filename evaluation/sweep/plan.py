"""Which flights a sweep flies, and which units it measures on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from evaluation.protocol.setups import Setup
from evaluation.protocol.trials import Protocol
from evaluation.sweep.dials import Point, Subject, turned
from evaluation.sweep.vary import Vary, points
from evaluation.units.unit import Unit, grouped
from sim.presets import SensorPreset
from sim.rendered import Flight
from sim.scene import Scene


@dataclass(frozen=True)
class SweepPlan:
    """What to sweep.

    Attributes:
        varied: The dials and their values.
        scenes: Which worlds.
        flights: How many flights over each, every one over a heap of its own.
        setup: What is measured, with the dials where they are not turned.
        sensors: The same of the sensors.
        protocol: How much is measured on each flight.
        seed: Of the first flight; the next ones have the next seeds.
        duration_s: Cuts flights short; the scene's own length if None.
    """

    varied: tuple[Vary, ...]
    scenes: tuple[Scene, ...]
    flights: int
    setup: Setup
    sensors: SensorPreset
    protocol: Protocol
    seed: int
    duration_s: float | None = None

    def points(self) -> list[Point]:
        """Every combination of the dials' values."""
        return points(self.varied)

    def units(self, point: Point) -> list[Unit]:
        """What is measured at one point: the same seeds at each, so that points are paired.

        Raises:
            InputError: The dials cannot stand so.
        """
        return [unit for scene in self.scenes for unit in self._of_scene(scene, point)]

    def tasks(self) -> int:
        """How many tasks there are at most: units that share their maps are done together."""
        return len(grouped(unit for point in self.points() for unit in self.units(point)))

    def _of_scene(self, scene: Scene, point: Point) -> Sequence[Unit]:
        subject = turned(Subject(scene, self.sensors, self.setup.config), point)
        setup = replace(self.setup, config=subject.config)
        return [
            Unit(
                Flight(subject.scene, seed, 0, subject.sensors, self.duration_s),
                seed,
                0,
                setup,
                self.protocol,
            )
            for seed in range(self.seed, self.seed + self.flights)
        ]
