"""`airground accept`: make results the ones that later changes are held against."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from evaluation.commands.check import ACCEPTED
from evaluation.commands.words import Verb


@dataclass(frozen=True, kw_only=True)
class Accept(Verb):
    """Accept results: later changes are held against them.

    Look at what moved by check first. The reason is kept in the file's history, with the
    figures of all that was accepted before.
    """

    results: Annotated[Positional[Path], arg(metavar="RESULTS")]
    """Folder that run or reproduce has written."""
    reason: Annotated[str, arg(metavar="TEXT")]
    """Why these figures are right; kept with them."""
    to: Annotated[
        Path, arg(metavar="FILE", help_behavior_hint="(default: evaluation/accepted.json)")
    ] = ACCEPTED
    """Where to keep them."""

    def main(self) -> None:
        from datetime import UTC, datetime

        from evaluation.judge.accepted import Accepted
        from evaluation.judge.measured import Measured
        from evaluation.judge.results import SUMMARY, read_table
        from evaluation.judge.summary import Summary

        before = Accepted.read(self.to) if self.to.exists() else None
        measured = Measured.of(read_table(self.results))
        revision = Summary.read(self.results / SUMMARY).git_revision
        today = datetime.now(UTC).date()
        Accepted.of(measured, revision, self.reason, before, today).write(self.to)
        print(f"{self.to}: accepted {measured.suite}, measured at {revision}")
