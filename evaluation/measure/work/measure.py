"""Has units measured that are not finished yet, and gives the results of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from airground.errors import InputError
from evaluation.measure.work.code_version import code_version
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.experiment import measure_units
from evaluation.measure.work.unit import Finished, Unit, UnitStore, grouped
from evaluation.setup.progress import step


@dataclass(frozen=True)
class Group:
    """Units that share their maps, on their way to a worker.

    Attributes:
        units: The units; extras are those of the first.
        renderers: Processes that draw images on the fly.
        code: Version of the code that must measure them.
    """

    units: list[Unit]
    renderers: int
    code: str


@dataclass(frozen=True)
class Refused:
    """Why a task cannot be done, now or ever: no worker need try again."""

    reason: str


def measure(units: Sequence[Unit], store: UnitStore, crew: Crew) -> list[Finished]:
    """The results of all units, in their order; those that the store has are not run again.

    Each is kept as soon as it is done. Units that share their maps are done together.

    Raises:
        InputError: A unit cannot be measured.
        OSError: A result cannot be kept.
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
