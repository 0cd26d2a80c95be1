"""Plans of flights: each is recorded, and its units are measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count, islice
from pathlib import Path
from types import MappingProxyType

from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.measure import measure, recording_name
from evaluation.measure.work.unit import Finished, Unit, UnitStore, grouped
from evaluation.setup.setups import Setup
from evaluation.table.rows import CONTROL_SCENES, SEQUENCE_KEYS, UNSCORED_SCENES
from sim.recording.recorder import Flight
from sim.scene import Scene
from sim.sensors.presets import SensorPreset

NOTHING: Mapping[str, Path] = MappingProxyType({})


@dataclass(frozen=True)
class Plan:
    """Flights, and what is measured on each.

    Attributes:
        flights: Flights that are flown in any case.
        setups: Setups to measure, the primary setup first.
        protocol: Extent of the measurements on each flight.
        budget: Whether to measure the error budget of the primary setup.
        negatives: Whether to try the negative cases with the primary setup.
        sequences: Smallest number of sequences of the primary setup, unscored scenes excluded;
            0 for those that `flights` give.
    """

    flights: list[Flight]
    setups: list[Setup]
    protocol: Protocol
    budget: bool = False
    negatives: bool = True
    sequences: int = 0

    def further_flights(self) -> Iterator[Flight]:
        """The same flights with the next seeds, without end, unscored scenes excluded."""
        flights = [f for f in self.flights if f.scene.name not in UNSCORED_SCENES]
        seeds = {flight.seed for flight in flights}
        for step in count(1) if flights else ():
            ahead = step * (max(seeds) - min(seeds) + 1)
            yield from (replace(flight, seed=flight.seed + ahead) for flight in flights)

    def certain_flights(self) -> list[Flight]:
        """`flights`, and those of the further ones that so many sequences need in any case."""
        scored = [one for one in self.flights if one.scene.name not in UNSCORED_SCENES]
        missing = self.sequences - len(scored) * self.protocol.sequences
        return self.flights + list(islice(self.further_flights(), self._least_flights(missing)))

    def _least_flights(self, sequences: int) -> int:
        """Least number of flights with so many sequences: none gives more than was asked of it."""
        return max(0, -(-sequences // self.protocol.sequences))

    def tasks(self) -> int:
        """Number of groups of units on the certain flights, each one task of a worker."""
        flights = self.certain_flights()
        return len(grouped(unit for flight in flights for unit in self.units(flight)))

    def measured(self, recordings: Path | None, store: UnitStore, crew: Crew) -> Finished:
        """Record and measure what is missing, flight after flight until there are enough sequences.

        The flights flown depend on the plan and on their sequences, not on the workers.

        Args:
            recordings: Folder of the recordings; existing ones with the right name are used.
                None keeps none: images are drawn while they are measured, once more for each pass.
            store: Units that an earlier run finished; takes those of this run.
            crew: Processes that do the work.
        """
        flights = self.certain_flights()
        further = islice(self.further_flights(), len(flights) - len(self.flights), None)
        flown: list[list[Finished]] = []
        while flights:
            flown += self._flown(flights, recordings, store, crew)
            missing = self.sequences - _sequences([units[0] for units in flown])
            flights = list(islice(further, self._least_flights(missing)))
        return Finished.merged([unit for units in flown for unit in units])

    def stranger(self, flight: Flight) -> Flight | None:
        """The flight whose ground map is the wrong one: the same flight over the next scene.
        None where no other scene holds anything to find."""
        scenes: list[Scene] = []
        for other in filter(_has_places, self.flights):
            scenes += [other.scene] if other.scene not in scenes else []
        here = scenes.index(flight.scene)
        others = scenes[here + 1 :] + scenes[:here]
        return replace(flight, scene=others[0]) if others else None

    def units(self, flight: Flight, recordings: Mapping[str, Path] = NOTHING) -> list[Unit]:
        """The units of one flight, that of the primary setup first; `recordings` are by their
        `recording_name`, and images of others are drawn."""

        def where(of: Flight) -> Path | Flight:
            return recordings.get(recording_name(of), of)

        # Further flights bring sequences, of setups that share the maps of the primary one.
        is_first = flight in self.flights
        setups = [s for s in self.setups if is_first or s.maps_like(self.setups[0])]
        primary, *others = (
            Unit(where(flight), flight.seed, flight.flight, setup, self.protocol)
            for setup in setups
        )
        negatives = self.negatives and is_first and _has_places(flight)
        stranger = self.stranger(flight) if negatives else None
        primary = replace(
            primary,
            showcase=flight == self.flights[0],
            budget=self.budget,
            baselines=self.protocol.baselines > 0,
            negatives=negatives,
            stranger=None if stranger is None else where(stranger),
            appearance=flight if self._matches_images(flight) else None,
        )
        return [primary, *others]

    def _matches_images(self, flight: Flight) -> bool:
        """Whether images of its world are matched: of one world a scene, since each takes
        minutes."""
        of_scene = [other for other in self.flights if other.scene == flight.scene]
        return self.protocol.baselines > 0 and _has_places(flight) and flight == of_scene[0]

    def _flown(
        self, flights: list[Flight], recordings: Path | None, store: UnitStore, crew: Crew
    ) -> list[list[Finished]]:
        """The finished units of each flight, that of the primary setup first."""
        places: dict[Path, Flight] = {}
        if recordings is not None:
            recordings.mkdir(parents=True, exist_ok=True)
            places = {recordings.absolute() / recording_name(one): one for one in flights}
        units = [self.units(flight, {path.name: path for path in places}) for flight in flights]
        all_units = [unit for of_flight in units for unit in of_flight]
        finished = iter(measure(all_units, store, crew, places))
        return [[next(finished) for _ in of_flight] for of_flight in units]


def flights_over(
    scenes: Sequence[Scene], flights: int, sensors: SensorPreset, seed: int, heaps: bool = False
) -> list[Flight]:
    """Some flights over each scene: all over one heap with one seed, or each over a heap of its
    own with the next seed (`heaps`)."""
    places = [(seed + number, 0) if heaps else (seed, number) for number in range(flights)]
    return [Flight(scene, *place, sensors) for scene in scenes for place in places]


def _has_places(flight: Flight) -> bool:
    """Whether the scene holds anything to find."""
    return flight.scene.name not in CONTROL_SCENES


def _sequences(finished: Sequence[Finished]) -> int:
    """Number of sequences, unscored scenes excluded."""
    total = 0
    for unit in finished:
        frame = unit.table.rows("localization", "error_m")
        frame = frame[~frame["scene"].isin(UNSCORED_SCENES)]
        total += len(frame[SEQUENCE_KEYS].drop_duplicates())
    return total
