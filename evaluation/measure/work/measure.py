"""Tasks for the workers: record flights and measure units, where the results are not there yet."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from airground.errors import InputError
from evaluation.measure.work.code_version import code_version
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.experiment import measure_units
from evaluation.measure.work.unit import Finished, Unit, UnitStore, grouped
from evaluation.setup.progress import step
from sim.recording.recorder import Flight, record

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Group:
    """Units that share their maps, as sent to a worker.

    Attributes:
        units: The units; extras are those of the first.
        renderers: Number of processes that render images on the fly.
        code: Version of the code that must measure them.
    """

    units: list[Unit]
    renderers: int
    code: str


@dataclass(frozen=True)
class ToRecord:
    """A flight, the path of its recording, and the number of rendering processes."""

    flight: Flight
    path: Path
    workers: int


@dataclass(frozen=True)
class Refused:
    """Reason for which no worker can do a task, so that none tries again."""

    reason: str


def measure(units: Sequence[Unit], store: UnitStore, crew: Crew) -> list[Finished]:
    """Results of all units, in their order; only units missing from the store are measured.

    Each result is stored as soon as it is there. Units that share their maps are one task.

    Raises:
        InputError: A unit cannot be measured.
        OSError: A result cannot be stored.
    """
    keys = [unit.key() for unit in units]
    missing = {key: unit for key, unit in zip(keys, units, strict=True) if key not in store}
    groups = grouped(missing.values())
    cores = crew.share(len(groups))
    sent = [Group(group, cores, code_version()) for group in groups]
    count = len(set(keys))
    with step("measuring", count, "units", done=count - len(missing)) as measuring:
        for index, outcome in crew.outcomes(work, sent):
            if isinstance(outcome, Refused):
                raise InputError(outcome.reason)
            for unit, finished in zip(groups[index], outcome, strict=True):
                store.write(unit.key(), unit.made_from(), finished)
            measuring.advance(len(groups[index]))
    return [store.read(key) for key in keys]


def work(group: Group) -> list[Finished] | Refused:
    """Measure a group; called in a worker."""
    if code_version() != group.code:
        return Refused(
            "a worker has other sources or libraries than this machine; install the same"
        )
    try:
        return measure_units(group.units, group.renderers)
    except InputError as error:
        return Refused(str(error))


def recorded(flights: Sequence[Flight], folder: Path, crew: Crew) -> list[Path]:
    """Paths of the flights' recordings; those in the folder with the right name are used.

    Raises:
        InputError: A flight is impossible, or workers elsewhere do not see this folder.
    """
    paths = [folder.absolute() / recording_name(flight) for flight in flights]
    missing = [pair for pair in zip(flights, paths, strict=True) if not pair[1].exists()]
    for path in paths:
        if path.exists():
            log.info("using the recording %s", path)
    folder.mkdir(parents=True, exist_ok=True)
    cores = crew.share(len(missing))
    with step("recording", len(missing), "flights") as recording:
        tasks = [ToRecord(flight, path, cores) for flight, path in missing]
        for _, refused in crew.outcomes(record_flight, tasks):
            if refused is not None:
                raise InputError(refused.reason)
            recording.advance()
    for path in paths:
        if not path.exists():
            raise InputError(f"{path}: workers elsewhere record to another disk; give --render")
    return paths


def record_flight(task: ToRecord) -> Refused | None:
    """Record a flight; called in a worker."""
    flight = task.flight
    if task.path.exists():  # recorded by a worker that died before it answered
        return None
    try:
        record(
            flight.scene,
            flight.seed,
            flight.sensors,
            task.path,
            flight.duration_s,
            workers=task.workers,
            flight=flight.flight,
            dials=flight.dials,
        )
    except InputError as error:
        return Refused(str(error))
    return None


def recording_name(flight: Flight) -> str:
    """Name of a flight's recording; one whose dials are turned has another name than one whose
    dials are not."""
    length = "" if flight.duration_s is None else f"_{flight.duration_s:g}s"
    number = f"seed{flight.seed}_flight{flight.flight}"
    dials = "".join(f"_{name}={value:g}" for name, value in sorted((flight.dials or {}).items()))
    return f"{flight.scene.name}_{flight.sensors.name}_{number}{length}{dials}"
