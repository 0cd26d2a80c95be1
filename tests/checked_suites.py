"""Lets .ci/run measure a sample of the suites where all of them passed with the same sources.

`python -m tests.checked_suites keep RESULTS`, after `make regression`, writes checked_suites.json:
the version of the code that makes results, and a digest of the results of each flight.

`python -m tests.checked_suites sample RESULTS` measures some flights of each suite and compares.
It exits with 0 where sources and results are the same, and with 3 where the suites must run whole:
sources changed, or another processor rounds differently.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

from airground.io.digests import bytes_digest
from evaluation.setup.environment import prepare, usable_cores
from tests.sources import ROOMS, ROOT, sources

if TYPE_CHECKING:
    from evaluation.measure.plans.reproduce import Plan
    from evaluation.measure.suite import SuiteName
    from evaluation.table.rows import ResultTable

FILE = ROOT / "tests/checked_suites.json"
SAMPLED = 2
"""Flights of each suite in a sample."""
EXIT_RUN_WHOLE = 3

Digests = Mapping[str, str]
"""By flight."""


@dataclass(frozen=True)
class Checked:
    """The version of the code, and what each flight of each suite gave with it."""

    code: str
    suites: Mapping[str, Digests]

    @classmethod
    def read(cls, path: Path) -> Checked:
        return cls(**json.loads(path.read_text(encoding="utf-8")))

    def write(self, path: Path) -> None:
        text = json.dumps({"code": self.code, "suites": self.suites}, indent=1)
        path.write_text(text + "\n", encoding="utf-8")


def digests(table: ResultTable) -> Digests:
    """A digest of the watched metrics of each flight, in the digits that accepted figures have."""
    from evaluation.judge.accepted import Measured

    measured = Measured.of(table)
    found = {}
    for flight in measured.flights:
        values = {name: samples.get(flight) for name, samples in measured.samples.items()}
        found[str(flight)] = bytes_digest(json.dumps(values, sort_keys=True).encode())[:16]
    return found


def keep(results: Path, path: Path = FILE) -> None:
    """Note what a run of all suites by the present sources gave, if nothing got worse."""
    from evaluation.commands.results import Check
    from evaluation.judge.results import read_table
    from evaluation.measure.suite import SUITES
    from evaluation.measure.work.code_version import code_version

    suites = {}
    for name in SUITES:
        folder = results / name
        measured = _measured_by(code_version(), folder)
        suites[name] = digests(read_table(folder))
        if measured < len(suites[name]):
            sys.exit(f"{folder}: measured by other sources; run make regression")
        if Check(results=folder).main() != 0:
            sys.exit(f"{folder}: something got worse")
    Checked(code_version(), suites).write(path)


def sample(results: Path, path: Path = FILE) -> str:
    """Measure some flights of each suite; the reason for running them whole, empty for none."""
    from evaluation.commands.reproduce import Reproduce
    from evaluation.measure.suite import SUITES
    from evaluation.measure.work.code_version import code_version

    checked = Checked.read(path)
    if checked.code != code_version():
        return "sources that make results changed since the suites were checked"
    for name in SUITES:
        out = results / name
        plan = Reproduce(out=out, suite=name).suite_plan(name)
        found = measured_sample(name, plan, out)
        print(f"suite {name}: measured {', '.join(found)}")
        before = checked.suites[name]
        other = [flight for flight, digest in found.items() if digest != before[flight]]
        if other:
            return f"suite {name}: {', '.join(other)} gave other results with the same sources"
    return ""


def measured_sample(name: SuiteName, plan: Plan, out: Path) -> Digests:
    """What some flights give: other flights for each version of the sources, tests included."""
    from evaluation.measure.work.crew import Crew
    from evaluation.measure.work.measure import measure
    from evaluation.measure.work.out_folder import resumable_folder
    from evaluation.measure.work.unit import Finished

    flights = Random(f"{tree_digest()} {name}").sample(plan.flights, SAMPLED)
    units = [unit for flight in flights for unit in plan.units(flight)]
    with (
        resumable_folder(out) as folder,
        Crew(None, usable_cores(), len(units), folder.scratch) as crew,
    ):
        return digests(Finished.merged(measure(units, folder.store, crew)).table)


def _measured_by(code: str, folder: Path) -> int:
    """How many units of a folder were measured by a version of the code."""
    made_from = (json.loads(f.read_bytes()) for f in folder.glob("units/*/made_from.json"))
    return sum(unit["code"] == code for unit in made_from)


def tree_digest() -> str:
    """A digest of all sources in this tree."""
    files = sources(*ROOMS, "tests")
    return bytes_digest(b"".join((ROOT / file).read_bytes() for file in files))


if __name__ == "__main__":
    prepare()
    command, folder = sys.argv[1], Path(sys.argv[2])
    if command == "keep":
        keep(folder)
    elif reason := sample(folder):
        print(f"{reason}: the suites run whole")
        sys.exit(EXIT_RUN_WHOLE)
