"""The figures of suites that passed whole, and the code and the machine that gave them."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

from airground.errors import InputError
from evaluation.commands.results import accepted_figures
from evaluation.judge.accepted import Accepted, Measured, compact_json
from evaluation.judge.results import SUMMARY, read_table
from evaluation.judge.summary import Summary
from evaluation.judge.verdict import Verdict, compare
from evaluation.measure.suite import SUITES, SuiteName
from evaluation.measure.work.code_version import code_version
from evaluation.setup.checked_json import Part, read_checked
from evaluation.setup.console import EXIT_OK, EXIT_WORSE
from evaluation.setup.output import write_whole
from evaluation.show.comparison.verdict_table import print_comparison
from tests.machine import machine

FILE = Path(__file__).with_name("figures.json")


class Checked(Part):
    """The version of the code, the machine (`tests.machine`), and the figures of each suite."""

    code: str
    machine: str
    suites: dict[SuiteName, Accepted]

    @classmethod
    def read(cls, path: Path) -> Checked:
        return read_checked(cls, path, "file of checked suites")

    def write(self, path: Path) -> None:
        write_whole(path, compact_json(self))


def keep(results: Path, path: Path = FILE) -> int:
    """Note what a run of all suites by the present sources gave, if nothing got worse.

    Raises:
        InputError: There are no results of a suite, or other sources measured them.
    """
    suites = {}
    for name in SUITES:
        measured = measured_whole(results / name)
        if not is_good(name, measured):
            return EXIT_WORSE
        revision = Summary.read(results / name / SUMMARY).git_revision
        today = datetime.now(UTC).date()
        suites[name] = Accepted.of(measured, revision, "passed whole", None, today)
    Checked(code=code_version(), machine=machine(), suites=suites).write(path)
    return EXIT_OK


def measured_whole(folder: Path) -> Measured:
    """The figures of a suite's run by the present sources."""
    measured = Measured.of(read_table(folder))
    made_from = (json.loads(file.read_bytes()) for file in folder.glob("units/*/made_from.json"))
    present = sum(unit["code"] == code_version() for unit in made_from)
    if present < len(measured.flights):
        raise InputError(f"{folder}: measured by other sources; run make regression")
    return measured


def is_good(name: SuiteName, measured: Measured) -> bool:
    """Whether no watched metric is worse than what is accepted; prints the verdicts if one is."""
    comparison = compare(Accepted.read(accepted_figures(name)).measured(), measured)
    worse = [one.metric.name for one in comparison.of(Verdict.WORSE)]
    if worse:
        print_comparison(comparison)
        print(f"suite {name}: {', '.join(worse)} got worse")
    return not worse
