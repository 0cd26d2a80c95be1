"""`airground compare`: two or more runs on one page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from evaluation.commands.words import OutWord, Verb


@dataclass(frozen=True, kw_only=True)
class Compare(Verb, OutWord):
    """Draw two to four runs on one page: what changed, and by how much.

    The first run is the reference. The verdicts are those of check, which gives an exit code
    instead of a page.
    """

    runs: Annotated[Positional[tuple[Path, ...]], arg(metavar="RUN ...")]
    """Folders that run or reproduce has written, the reference first."""

    def main(self) -> None:
        from evaluation.judge.runs import against, read_runs
        from evaluation.setup.output import fresh_folder
        from evaluation.show.comparison.page import PAGE, write_comparison
        from evaluation.show.comparison.verdict_table import conclusion

        reference, *others = read_runs(self.runs)
        helds = [against(reference, run) for run in others]
        with fresh_folder(self.out) as folder:
            write_comparison(folder, helds)
        for held in helds:
            print(f"{held.run.name} against {reference.name}: {conclusion(held.comparison)}")
        print(self.out / PAGE)
