"""`airground evaluate`, `compare`, `check`, `accept`: results reported and compared."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from airground.errors import InputError
from evaluation.commands.options import OutOption, Shown, Verb
from evaluation.setup.console import EXIT_OK, EXIT_WORSE

if TYPE_CHECKING:
    from evaluation.judge.accepted import Measured

ACCEPTED = Path(__file__).parents[1] / "accepted.json"
"""Accepted figures of the suite `fast`; those of another one are beside it."""


def accepted_file(results: Path) -> Path:
    """Where the accepted figures of the suite are that a run's folder holds."""
    from evaluation.judge.results import read_table

    conditions = read_table(results).conditions()
    suite = re.fullmatch("suite ([a-z]+)", conditions[0].variant if conditions else "")
    return accepted_figures("fast" if suite is None else suite[1])


def accepted_figures(suite: str) -> Path:
    """Where the accepted figures of a suite are."""
    return ACCEPTED if suite == "fast" else ACCEPTED.with_stem(f"accepted_{suite}")


@dataclass(frozen=True, kw_only=True)
class Evaluate(OutOption, Verb):
    """Put the results of one or more runs into one report.

    The first run's condition leads; runs under other conditions stand beside it.
    """

    runs: Annotated[Positional[tuple[Path, ...]], Shown("RUN ...")]
    """folders that run or reproduce has written"""

    def main(self) -> None:
        from evaluation.judge.results import merged, read_results
        from evaluation.setup.output import fresh_folder
        from evaluation.setup.progress import step
        from evaluation.show.report.page import write_results
        from evaluation.show.report.screen import print_summary

        if not self.runs:
            raise InputError("no RUN given: name at least one folder of run or reproduce")
        results = merged([read_results(run) for run in self.runs])
        with fresh_folder(self.out) as folder, step("writing the report"):
            summary = write_results(results, folder)
        print_summary(summary)


@dataclass(frozen=True, kw_only=True)
class Compare(OutOption, Verb):
    """Draw two to four runs on one page: what changed, and by how much.

    The first run is the reference. The verdicts are those of check, which gives an exit code
    instead of a page.
    """

    runs: Annotated[Positional[tuple[Path, ...]], Shown("RUN ...")]
    """folders that run or reproduce has written, the reference first"""

    def main(self) -> None:
        from evaluation.judge.runs import against, read_runs
        from evaluation.setup.output import fresh_folder
        from evaluation.setup.progress import step
        from evaluation.show.comparison.page import PAGE, Parted, write_comparison
        from evaluation.show.comparison.verdict_table import conclusion
        from evaluation.show.rerun_view.differences import hold_folders, print_worsened

        reference, *others = read_runs(self.runs)
        helds = [against(reference, run) for run in others]
        first, *rest = self.runs
        parted = [Parted(first, run, hold_folders(first, run, ACCEPTED)) for run in rest]
        with fresh_folder(self.out) as folder, step("drawing the comparison"):
            write_comparison(folder, helds, parted)
        for held in helds:
            print(f"{held.run.name} against {reference.name}: {conclusion(held.comparison)}")
        for held, each in zip(helds, parted, strict=True):
            print_worsened(held.comparison, each.differences, first, each.run)
        print(self.out / PAGE)


@dataclass(frozen=True, kw_only=True)
class Check(Verb):
    """Hold results against accepted ones: better, worse, or no difference seen.

    Exits with 1 if a watched metric got worse beyond chance and by more than matters.
    """

    results: Annotated[Positional[Path], Shown("RESULTS")]
    """folder that run or reproduce has written"""
    against: Annotated[Path | None, Shown("FILE", "the accepted figures of the suite")] = None
    """file that accept has written, or folder of other results"""
    markdown: Annotated[Path | None, Shown("FILE")] = None
    """write the table for a pull request"""
    junit: Annotated[Path | None, Shown("FILE")] = None
    """write one test case per metric for continuous integration"""
    as_json: Annotated[Path | None, arg(name="json"), Shown("FILE")] = None
    """write verdicts, figures and intervals for programs"""
    badge: Annotated[Path | None, Shown("FILE")] = None
    """write the verdict as an endpoint badge of shields.io"""

    def main(self) -> int:
        from evaluation.judge.accepted import Measured
        from evaluation.judge.results import read_table
        from evaluation.judge.verdict import Verdict, compare
        from evaluation.show.comparison import verdict_json, verdict_table

        against = self.against or accepted_file(self.results)
        before = self._reference(against)
        try:
            after = Measured.of(read_table(self.results), before.condition)
            comparison = compare(before, after)
        except InputError as error:
            if self.against is not None:
                raise
            hint = "these are the accepted results of the suite; --against names others"
            raise InputError(f"{error} ({hint})") from None
        verdict_table.print_comparison(comparison)
        if against.is_dir():
            from evaluation.show.rerun_view.differences import hold_folders, print_worsened

            helds = hold_folders(against, self.results, ACCEPTED)
            print_worsened(comparison, helds, against, self.results)
        for file, written in (
            (self.markdown, verdict_table.markdown),
            (self.junit, verdict_table.junit),
            (self.as_json, verdict_json.as_json),
            (self.badge, verdict_json.badge),
        ):
            if file is not None:
                file.write_text(written(comparison), encoding="utf-8")
        return EXIT_WORSE if comparison.of(Verdict.WORSE) else EXIT_OK

    def _reference(self, against: Path) -> Measured:
        """The figures in a file or folder; results of another level are no reference."""
        from evaluation.judge.accepted import Accepted, Measured
        from evaluation.judge.results import read_level, read_table
        from evaluation.setup.level_mark import check_same_level

        if not against.is_dir():
            return Accepted.read(against).measured()
        check_same_level(read_level(against), read_level(self.results), str(self.results))
        return Measured.of(read_table(against))


@dataclass(frozen=True, kw_only=True)
class Accept(Verb):
    """Accept results: later changes are held against them.

    Look at what moved by check first. The reason is kept in the file's history, with the
    figures of all that was accepted before.
    """

    results: Annotated[Positional[Path], Shown("RESULTS")]
    """folder that run or reproduce has written"""
    reason: Annotated[str, Shown("TEXT")]
    """why these figures are right; kept with them"""
    to: Annotated[Path | None, Shown("FILE", "the accepted figures of the suite")] = None
    """file to keep them in"""

    def main(self) -> None:
        from datetime import UTC, datetime

        from evaluation.judge.accepted import Accepted, Measured
        from evaluation.judge.results import SUMMARY, read_table
        from evaluation.judge.summary import Summary

        file = self.to or accepted_file(self.results)
        before = Accepted.read(file) if file.exists() else None
        measured = Measured.of(read_table(self.results))
        revision = Summary.read(self.results / SUMMARY).git_revision
        today = datetime.now(UTC).date()
        Accepted.of(measured, revision, self.reason, before, today).write(file)
        print(f"{file}: accepted {measured.suite}, measured at {revision}")
