"""`airground check`: did a change make it better or worse."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from evaluation.commands.words import Verb

if TYPE_CHECKING:
    from evaluation.judge.measured import Measured

ACCEPTED = Path(__file__).parents[1] / "accepted.json"


@dataclass(frozen=True, kw_only=True)
class Check(Verb):
    """Hold results against accepted ones: better, worse, or no difference seen.

    Exits with 1 if a watched metric got worse beyond chance and by more than matters.
    """

    results: Annotated[Positional[Path], arg(metavar="RESULTS")]
    """Folder that run or reproduce has written."""
    against: Annotated[
        Path, arg(metavar="FILE", help_behavior_hint="(default: evaluation/accepted.json)")
    ] = ACCEPTED
    """What accept has written, or a folder of other results."""
    markdown: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(optional)")] = None
    """Write the table for a pull request."""
    junit: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(optional)")] = None
    """Write one test case a metric for continuous integration."""

    def main(self) -> int:
        from evaluation.judge.measured import Measured
        from evaluation.judge.results import read_table
        from evaluation.judge.verdict import Verdict, compare
        from evaluation.show.comparison import verdict_table

        before = self._reference()
        after = Measured.of(read_table(self.results), before.condition)
        comparison = compare(before, after)
        verdict_table.print_comparison(comparison)
        if self.markdown is not None:
            self.markdown.write_text(verdict_table.markdown(comparison), encoding="utf-8")
        if self.junit is not None:
            self.junit.write_text(verdict_table.junit(comparison), encoding="utf-8")
        return int(bool(comparison.of(Verdict.WORSE)))

    def _reference(self) -> Measured:
        from evaluation.judge.accepted import Accepted
        from evaluation.judge.measured import Measured
        from evaluation.judge.results import read_table

        if self.against.is_dir():
            return Measured.of(read_table(self.against))
        return Accepted.read(self.against).measured()
