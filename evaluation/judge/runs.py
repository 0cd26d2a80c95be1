"""The runs of a comparison: read back, named, and paired flight by flight."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from airground.config import Config
from airground.errors import InputError
from evaluation.judge.accepted import Measured
from evaluation.judge.results import SUMMARY, read_results
from evaluation.judge.samples import Flight
from evaluation.judge.summary import Summary
from evaluation.judge.verdict import MOVED, Comparison, Verdict, compare
from evaluation.setup.level_mark import check_same_level
from evaluation.table.rows import SEQUENCE_KEYS, ResultTable

MOST_RUNS = 4
"""More runs would have no colour of their own in a figure."""


@dataclass(frozen=True)
class Run:
    """What one run left, of its primary condition; `table` includes control scenes."""

    name: str
    table: ResultTable
    config: Config
    summary: Summary
    measured: Measured

    @classmethod
    def read(cls, folder: Path, name: str) -> Run:
        """Raises InputError where a file is missing or damaged."""
        results = read_results(folder)
        measured = Measured.of(results.table)
        table = results.table.of(measured.condition)
        return cls(name, table, results.config, Summary.read(folder / SUMMARY), measured)

    def on(self, flights: set[Flight]) -> ResultTable:
        """Its rows of some flights, control scenes apart."""
        keys = list(self.table.frame[SEQUENCE_KEYS[:3]].itertuples(index=False, name=None))
        kept = [
            Flight(str(scene), int(seed), int(flight)) in flights for scene, seed, flight in keys
        ]
        return ResultTable(self.table.frame[kept]).scored()


@dataclass(frozen=True)
class Against:
    """A run held against the reference.

    Attributes:
        reference, run: Both sides.
        comparison: Metric by metric.
        shared: The flights that both have; empty where none is, and samples were compared.
        left_out: How many flights only one side has, where others are shared.
    """

    reference: Run
    run: Run
    comparison: Comparison
    shared: set[Flight]
    left_out: int

    def caveats(self) -> list[str]:
        """Limits of the comparison that a reader needs beside the verdicts."""
        made = []
        if not self.shared:
            made.append(
                "No flight is the same in both runs: they are compared as two samples, which is "
                "less sensitive than pairs and assumes that the flights of both are drawn alike."
            )
        if self.left_out:
            made.append(
                f"Compared over the {len(self.shared)} flights that both have; {self.left_out} "
                "that only one has are left out."
            )
        for what, stage, key in (
            ("sequences", "localization", "sequence"),
            ("refinement trials", "refinement", "trial"),
        ):
            before, after = (_most(run.table, stage, key) for run in (self.reference, self.run))
            if self.shared and before != after:
                made.append(
                    f"Up to {after} {what} a flight against {before}: what only one has counts as "
                    "failed on the other."
                )
        if self.reference.measured.condition != self.run.measured.condition:
            made.append(
                f"Other conditions: {self.run.measured.condition.label()}, against "
                f"{self.reference.measured.condition.label()}."
            )
        return made

    def outcome(self) -> str:
        """Number of metrics with each verdict of a change, in a few words."""
        found = {verdict: len(self.comparison.of(verdict)) for verdict in MOVED}
        counts = [f"{count} {verdict}" for verdict, count in found.items() if count]
        if not counts and not self.comparison.of(Verdict.SAME):
            return "no verdict possible"
        return ", ".join(counts) or str(Verdict.SAME)


def read_runs(folders: Sequence[Path]) -> list[Run]:
    """All of them, the first is the reference.

    Raises:
        InputError: Too few or too many, one twice, or one that cannot be read.
    """
    if not 2 <= len(folders) <= MOST_RUNS:
        raise InputError(
            f"{len(folders)} given; expected 2 to {MOST_RUNS} folders that run or reproduce wrote"
        )
    twice = [path for path, count in Counter(p.resolve() for p in folders).items() if count > 1]
    if twice:
        raise InputError(f"{twice[0]}: given twice; compare different runs")
    names = distinct_names(folders)
    return [Run.read(folder, name) for folder, name in zip(folders, names, strict=True)]


def against(reference: Run, run: Run) -> Against:
    """Hold a run against the reference, over the flights that both have.

    Without a shared flight, all flights of both are compared as two samples.

    Raises:
        InputError: They are of different levels, or no flight is shared and the scenes or numbers
            of flights differ too.
    """
    check_same_level(reference.summary.level, run.summary.level, run.name)
    before, after = reference.measured, run.measured
    shared = set(before.flights) & set(after.flights)
    left_out = 0
    if shared:
        left_out = len(set(before.flights) ^ set(after.flights))
        before, after = before.only(shared), after.only(shared)
    elif before.suite != after.suite:
        raise InputError(
            f"{run.name}: has no flight of {reference.name} (scene, seed and flight), and measured "
            f"{after.suite} instead of {before.suite}; compare runs over the same scenes"
        )
    return Against(reference, run, compare(before, after), shared, left_out)


def distinct_names(folders: Sequence[Path]) -> list[str]:
    """The folders' names, preceded by parents' names until all differ."""
    parts = [folder.resolve().parts for folder in folders]
    depth = 1
    while len({part[-depth:] for part in parts}) < len(parts):
        depth += 1
    return ["/".join(part[-depth:]) for part in parts]


def _most(table: ResultTable, stage: str, key: str) -> int:
    """How many sequences, or trials, the flight with the most of them has."""
    rows = table.frame[table.frame["stage"] == stage]
    counts = rows.groupby(SEQUENCE_KEYS[:3])[key].nunique()
    return int(counts.max()) if len(counts) else 0
