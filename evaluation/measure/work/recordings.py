"""Recordings of flights, made where they are not there yet."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from airground.errors import InputError
from evaluation.measure.work.crew import Crew
from evaluation.setup.progress import step
from sim.recording.recorder import record
from sim.recording.rendered import Flight

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class ToRecord:
    """A flight, where its recording is to be, and how many processes draw its images."""

    flight: Flight
    path: Path
    workers: int


def recorded(flights: Sequence[Flight], folder: Path, crew: Crew) -> list[Path]:
    """Where the flights' recordings are; those in the folder with the right name are used.

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
        for _, refusal in crew.outcomes(record_flight, tasks):
            if refusal is not None:
                raise InputError(refusal)
            recording.advance()
    for path in paths:
        if not path.exists():
            raise InputError(f"{path}: workers elsewhere record to another disk; give --render")
    return paths


def record_flight(task: ToRecord) -> str | None:
    """Record a flight, in a worker; says why where it cannot be."""
    flight = task.flight
    if task.path.exists():  # by a worker that died before it could say so
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
        )
    except InputError as error:
        return str(error)
    return None


def recording_name(flight: Flight) -> str:
    """What tells flights over the scenes apart."""
    length = "" if flight.duration_s is None else f"_{flight.duration_s:g}s"
    number = f"seed{flight.seed}_flight{flight.flight}"
    return f"{flight.scene.name}_{flight.sensors.name}_{number}{length}"
