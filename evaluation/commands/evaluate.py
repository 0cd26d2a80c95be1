"""`airground evaluate`: a report from what runs left."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from airground.errors import InputError
from evaluation.commands.words import OutWord, Verb


@dataclass(frozen=True, kw_only=True)
class Evaluate(Verb, OutWord):
    """Put the results of one or more runs into one report.

    The first run's condition leads; runs under other conditions stand beside it.
    """

    runs: Annotated[Positional[tuple[Path, ...]], arg(metavar="RUN ...")]
    """Folders that run or reproduce has written."""

    def main(self) -> None:
        from evaluation.judge.results import merged, read_results
        from evaluation.setup.output import fresh_folder
        from evaluation.show.report.page import write_results
        from evaluation.show.report.screen import print_summary

        if not self.runs:
            raise InputError("no RUN given: name at least one folder of run or reproduce")
        results = merged([read_results(run) for run in self.runs])
        with fresh_folder(self.out) as folder:
            summary = write_results(results, folder)
        print_summary(summary)
