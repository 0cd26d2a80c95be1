"""Has units measured that are not finished yet, and gives the results of all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from airground.errors import AirgroundError, InputError
from evaluation.measure.work.code_version import code_version
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.experiment import Outcome, Task, run_task
from evaluation.measure.work.unit import Finished, Unit, UnitStore, grouped, task_of
from evaluation.setup.progress import step


@dataclass(frozen=True)
class Sent:
    """A task on its way to a worker, with the version of the code that must do it."""

    task: Task
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
    sent = [Sent(task_of(group, cores), code_version()) for group in groups]
    count = len(set(keys))
    with step("measuring", count, "units", done=count - len(missing)) as measuring:
        for index, outcome in crew.outcomes(work, sent):
            if isinstance(outcome, Refused):
                raise InputError(outcome.reason)
            _keep(groups[index], outcome, store)
            measuring.advance(len(groups[index]))
    return [store.read(key) for key in keys]


def work(sent: Sent) -> Outcome | Refused:
    """Do a task; called in a worker."""
    if code_version() != sent.code:
        return Refused(
            "a worker has other sources or libraries than this machine; install the same"
        )
    try:
        return run_task(sent.task)
    except InputError as error:
        return Refused(str(error))


def _keep(group: list[Unit], outcome: Outcome, store: UnitStore) -> None:
    """Write what was found of each unit; the showcase is that of the first."""
    if len(outcome.parts) != len(group):
        raise AirgroundError(f"{len(group)} setups were sent, {len(outcome.parts)} came back")
    showcase = outcome.showcase
    for unit, rows in zip(group, outcome.parts, strict=True):
        store.write(unit.key(), unit.made_from(), rows, showcase)
        showcase = None
