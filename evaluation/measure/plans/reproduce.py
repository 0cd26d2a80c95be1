"""The paper's protocol: scenes x flights, recorded, mapped, localized, refined."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from types import MappingProxyType

from evaluation.measure.protocol.trials import Protocol
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.measure import measure
from evaluation.measure.work.recordings import recorded, recording_name
from evaluation.measure.work.unit import Finished, Unit, UnitStore, grouped
from evaluation.setup.setups import Setup
from evaluation.table.rows import CONTROL_SCENES, SEQUENCE_KEYS
from sim.recording.rendered import Flight
from sim.scene import Scene
from sim.sensors.presets import SensorPreset

NOTHING: Mapping[str, Path] = MappingProxyType({})


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
        sequences: At least so many in all of the primary setup, control scenes apart; 0 for
            those that the flights give.
    """

    scenes: list[Scene]
    flights: int
    setups: list[Setup]
    sensors: SensorPreset
    protocol: Protocol
    seed: int
    budget: bool = False
    sequences: int = 0

    def first_flights(self) -> list[Flight]:
        """Those that are flown in any case."""
        return [
            Flight(scene, self.seed, flight, self.sensors)
            for scene in self.scenes
            for flight in range(self.flights)
        ]

    def further_flights(self) -> Iterator[Flight]:
        """Those that follow as far as sequences are wanting: the same with the next seeds."""
        scenes = [scene for scene in self.scenes if scene.name not in CONTROL_SCENES]
        seed = self.seed
        while scenes:
            seed += 1
            for scene in scenes:
                for flight in range(self.flights):
                    yield Flight(scene, seed, flight, self.sensors)

    def tasks(self) -> int:
        """How many tasks the first flights make."""
        return len(grouped(unit for flight in self.first_flights() for unit in self.units(flight)))

    def measured(self, recordings: Path | None, store: UnitStore, crew: Crew) -> Finished:
        """Record and measure what is not there yet, flight after flight until there is enough.

        Which flights are flown depends on the plan and on what they gave, not on who flew them.

        Args:
            recordings: Folder of the recordings; those in it with the right name are used. None
                keeps none: images are drawn while they are measured, once more for each pass.
            store: Has the units that an earlier run finished, and takes those of this one.
            crew: Does the work.
        """
        further = self.further_flights()
        flown = self._flown(self.first_flights(), recordings, store, crew)
        while (wanting := self.sequences - _sequences([units[0] for units in flown])) > 0:
            # No flight gives more sequences than this, so that none of them is one too many.
            flights = list(islice(further, -(-wanting // self.protocol.sequences)))
            if not flights:
                break  # only control scenes
            flown += self._flown(flights, recordings, store, crew)
        return Finished.merged([unit for units in flown for unit in units])

    def stranger(self, flight: Flight) -> Flight | None:
        """Whose ground map is the wrong one for a flight: the same flight over the next scene.

        None where no other scene holds anything to find.
        """
        places = [scene for scene in self.scenes if scene.name not in CONTROL_SCENES]
        here = places.index(flight.scene)
        others = (scene for scene in places[here:] + places[:here] if scene != flight.scene)
        other = next(others, None)
        return None if other is None else replace(flight, scene=other)

    def units(self, flight: Flight, recordings: Mapping[str, Path] = NOTHING) -> list[Unit]:
        """What is measured on one flight, that of the primary setup first.

        Args:
            flight: Which one.
            recordings: By the flights' `recording_name`; others are drawn on the fly.
        """

        def where(of: Flight) -> Path | Flight:
            return recordings.get(recording_name(of), of)

        first_flights = self.first_flights()
        # Flights that follow bring more sequences, of setups that need no maps of their own.
        setups = self.setups
        if flight not in first_flights:
            setups = [setup for setup in setups if setup.maps_like(setups[0])]
        units = [
            Unit(where(flight), flight.seed, flight.flight, setup, self.protocol)
            for setup in setups
        ]
        negatives = flight in first_flights and flight.scene.name not in CONTROL_SCENES
        stranger = self.stranger(flight) if negatives else None
        units[0] = replace(
            units[0],
            showcase=flight == first_flights[0],
            budget=self.budget,
            baselines=self.protocol.baselines > 0,
            negatives=negatives,
            stranger=None if stranger is None else where(stranger),
        )
        return units

    def _flown(
        self, flights: list[Flight], recordings: Path | None, store: UnitStore, crew: Crew
    ) -> list[list[Finished]]:
        """The units of each flight, that of the primary setup first."""
        made: dict[str, Path] = {}
        if recordings is not None:
            made = {path.name: path for path in recorded(flights, recordings, crew)}
        units = [self.units(flight, made) for flight in flights]
        finished = iter(measure([unit for of_flight in units for unit in of_flight], store, crew))
        return [[next(finished) for _ in of_flight] for of_flight in units]


def _sequences(finished: Sequence[Finished]) -> int:
    """How many there are, control scenes apart."""
    count = 0
    for unit in finished:
        frame = unit.table.rows("localization", "error_m")
        frame = frame[~frame["scene"].isin(CONTROL_SCENES)]
        count += len(frame[SEQUENCE_KEYS].drop_duplicates())
    return count
