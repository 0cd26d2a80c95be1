"""Tasks for the workers: record flights and measure units, where the results are not there yet."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from airground.errors import InputError
from evaluation.measure.work.code_version import code_version
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.experiment import measure_units
from evaluation.measure.work.unit import Finished, Unit, UnitStore, grouped
from evaluation.setup.progress import step
from sim.recording.recorder import Flight, record

log = logging.getLogger(__name__)

NO_FLIGHTS: Mapping[Path, Flight] = MappingProxyType({})


@dataclass(frozen=True)
class ToRecord:
    """A flight, the path of its recording, and the number of rendering processes."""

    flight: Flight
    path: Path
    renderers: int


@dataclass(frozen=True)
class Group:
    """Units that share their maps.

    Attributes:
        units: The units; extras are those of the first.
        renderers: Number of processes that render images on the fly.
        code: Version of the code that must measure them.
    """

    units: list[Unit]
    renderers: int
    code: str


Task = ToRecord | Group


@dataclass(frozen=True)
class Refused:
    """Reason for which no worker can do a task, so that none tries again."""

    reason: str


def measure(
    units: Sequence[Unit],
    store: UnitStore,
    crew: Crew,
    flights: Mapping[Path, Flight] = NO_FLIGHTS,
) -> list[Finished]:
    """Results of all units, in their order; only units missing from the store are measured.

    Units that share their maps are one task, which begins once their recordings are there: while
    the last flights are recorded, others are measured. Each result is stored as soon as it is
    there.

    Args:
        units: What to measure.
        store: Units that an earlier run finished; takes those of this one.
        crew: Processes that do the work.
        flights: Flights by the path of their recording. Those that are missing are recorded.

    Raises:
        InputError: A flight is impossible, a unit cannot be measured, or workers elsewhere do not
            see the recordings.
        OSError: A result cannot be stored.
    """
    left = _Left(units, store, crew, flights)
    outcomes = crew.outcomes(work, left.tasks)
    if to_record := len(left.unrecorded):
        with step("recording", to_record, "flights") as recording:
            for index, outcome in outcomes:
                left.finish(index, outcome)
                recording.move_to(to_record - len(left.unrecorded))
                if not left.unrecorded:
                    break
    with step("measuring", len(units), "units", done=left.done) as measuring:
        for index, outcome in outcomes:
            left.finish(index, outcome)
            measuring.move_to(left.done)
    return [store.read(unit.key()) for unit in units]


class _Left:
    """What is left to do.

    Attributes:
        unrecorded: Flights by the path of their recording, as long as it is not there.
        tasks: Tasks of the workers; those of further units follow as flights are recorded.
        done: Number of units whose results are in the store.
    """

    def __init__(
        self,
        units: Sequence[Unit],
        store: UnitStore,
        crew: Crew,
        flights: Mapping[Path, Flight],
    ) -> None:
        self.unrecorded = {path: one for path, one in flights.items() if not path.exists()}
        for path in flights:
            if path not in self.unrecorded:
                log.info("using the recording %s", path)
        self.done = 0
        self._store, self._keys = store, set[str]()
        self._waiting = grouped(units)
        ready = self._take_ready()
        self._renderers = crew.share(len(self.unrecorded) + len(ready))
        self.tasks: list[Task] = [
            ToRecord(flight, path, self._renderers) for path, flight in self.unrecorded.items()
        ]
        self._add(ready)

    def finish(self, index: int, outcome: list[Finished] | Refused) -> None:
        """Take in the outcome of a task."""
        if isinstance(outcome, Refused):
            raise InputError(outcome.reason)
        task = self.tasks[index]
        if isinstance(task, ToRecord):
            if not task.path.exists():
                raise InputError(
                    f"{task.path}: workers elsewhere record to another disk; give --render"
                )
            del self.unrecorded[task.path]
            self._add(self._take_ready())
        else:
            for unit, finished in zip(task.units, outcome, strict=True):
                self._store.write(unit.key(), unit.made_from(), finished)
            self.done += len(task.units)

    def _take_ready(self) -> list[list[Unit]]:
        """The missing units of groups whose recordings are there, and which waited until now."""
        ready = [group for group in self._waiting if self._is_recorded(group)]
        self._waiting = [group for group in self._waiting if not self._is_recorded(group)]
        missing = [[unit for unit in group if self._is_missing(unit)] for group in ready]
        return [group for group in missing if group]

    def _is_recorded(self, group: list[Unit]) -> bool:
        needed = [place for unit in group for place in (unit.recording, unit.stranger)]
        return not any(place in self.unrecorded for place in needed if isinstance(place, Path))

    def _is_missing(self, unit: Unit) -> bool:
        """Whether its results are neither in the store nor under way."""
        key = unit.key()
        is_known = key in self._keys or key in self._store
        self._keys.add(key)
        self.done += is_known
        return not is_known

    def _add(self, groups: list[list[Unit]]) -> None:
        self.tasks += [Group(group, self._renderers, code_version()) for group in groups]


def work(task: Task) -> list[Finished] | Refused:
    """Do a task; called in a worker. A recording is on the disk, and gives no results."""
    try:
        if isinstance(task, ToRecord):
            _record(task)
            return []
        if code_version() != task.code:
            return Refused(
                "a worker has other sources or libraries than this machine; install the same"
            )
        return measure_units(task.units, task.renderers)
    except InputError as error:
        return Refused(str(error))


def _record(task: ToRecord) -> None:
    if task.path.exists():  # by a worker that died before it answered
        return
    flight = task.flight
    record(
        flight.scene,
        flight.seed,
        flight.sensors,
        task.path,
        flight.duration_s,
        workers=task.renderers,
        flight=flight.flight,
        dials=flight.dials,
    )


def recording_name(flight: Flight) -> str:
    """Name of a flight's recording; one whose dials are turned has another name than one whose
    dials are not."""
    length = "" if flight.duration_s is None else f"_{flight.duration_s:g}s"
    number = f"seed{flight.seed}_flight{flight.flight}"
    dials = "".join(f"_{name}={value:g}" for name, value in sorted((flight.dials or {}).items()))
    return f"{flight.scene.name}_{flight.sensors.name}_{number}{length}{dials}"
