"""Measures some flights of each suite, in place of all, where sources and results are the same.

On the machine where the suites passed, the same means each digit; on another, as good.
"""

from __future__ import annotations

from pathlib import Path
from random import Random

from airground.errors import InputError
from airground.io.digests import bytes_digest
from evaluation.commands.reproduce import Reproduce
from evaluation.judge.accepted import Measured
from evaluation.judge.samples import Flight
from evaluation.measure.plans.reproduce import Plan
from evaluation.measure.suite import SUITES, SuiteName
from evaluation.measure.work.code_version import code_version
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.measure import measure
from evaluation.measure.work.out_folder import resumable_folder
from evaluation.measure.work.unit import Finished
from evaluation.setup.console import EXIT_OK, EXIT_WORSE
from evaluation.setup.environment import usable_cores
from tests.checked_suites.figures import FILE, Checked, is_good
from tests.checked_suites.other_machine import as_good
from tests.machine import machine
from tests.sources import ROOMS, ROOT, sources

SAMPLED = 2
"""Flights of each suite in a sample."""
EXIT_RUN_WHOLE = 3


def sample(results: Path, path: Path = FILE) -> int:
    """Judge the kept figures of each suite anew, and measure some of its flights."""
    checked = Checked.read(path)
    if checked.code != code_version():
        return run_whole("sources that make results changed since the suites were checked")
    try:
        kept = {name: checked.suites[name].measured() for name in SUITES}
    except (KeyError, InputError) as error:
        return run_whole(f"other suites or metrics were checked: {error}")
    if not all(is_good(name, measured) for name, measured in kept.items()):
        return EXIT_WORSE
    is_same, wrong = (
        (equal, "gave other results")
        if checked.machine == machine()
        else (as_good, "gave worse results than on the machine where the suites passed")
    )
    for name, before in kept.items():
        out = results / name
        found = measured_sample(name, Reproduce(out=out, suite=name).suite_plan(name), out)
        print(f"suite {name}: measured {named(found.flights)}")
        if other := [flight for flight in found.flights if not is_same(before, found, flight)]:
            return run_whole(f"suite {name}: {named(other)} {wrong}")
    return EXIT_OK


def run_whole(reason: str) -> int:
    print(f"{reason}: the suites run whole")
    return EXIT_RUN_WHOLE


def measured_sample(name: SuiteName, plan: Plan, out: Path) -> Measured:
    """What some flights give: other flights for each version of the sources, tests included."""
    flights = Random(f"{tree_digest()} {name}").sample(plan.flights, SAMPLED)
    units = [unit for flight in flights for unit in plan.units(flight)]
    with (
        resumable_folder(out) as folder,
        Crew(None, usable_cores(), len(units), folder.scratch) as crew,
    ):
        return Measured.of(Finished.merged(measure(units, folder.store, crew)).table)


def equal(before: Measured, after: Measured, flight: Flight) -> bool:
    """Whether a flight has the same watched metrics, in the digits that files keep."""
    pairs = ((before.samples[name], after.samples[name]) for name in after.samples)
    return all(old.get(flight) == new.get(flight) for old, new in pairs)


def named(flights: list[Flight]) -> str:
    return ", ".join(map(str, flights))


def tree_digest() -> str:
    """A digest of all sources in this tree."""
    files = sources(*ROOMS, "tests")
    return bytes_digest(b"".join((ROOT / file).read_bytes() for file in files))
