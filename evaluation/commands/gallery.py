"""`airground gallery`: the pictures of a run, without a screen."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from airground.errors import InputError
from evaluation.commands.words import OutWord, Verb

if TYPE_CHECKING:
    from evaluation.measure.showcase import Showcase


@dataclass(frozen=True, kw_only=True)
class Gallery(Verb, OutWord):
    """Draw the pictures of a run as PNG files: maps, depth, costs, particles, errors.

    They are those of the report, drawn from what run --rerun or reproduce has kept.
    """

    run: Annotated[Positional[Path], arg(metavar="RUN")]
    """A folder that run --rerun or reproduce has written."""
    animation: bool = False
    """Also draw how the first aerial surface finds its place, as an animated WebP."""

    def main(self) -> None:
        from evaluation.judge.results import TABLE, read_results
        from evaluation.setup.output import fresh_folder
        from evaluation.show.figures.style import save_picture
        from evaluation.show.report.figures import report_figures

        if self.run.is_dir() and not (self.run / TABLE).exists():
            raise InputError(
                f"{self.run}: has no {TABLE}, so nothing in it was held against a truth; "
                "airground view shows what run --rerun has kept"
            )
        results = read_results(self.run)
        if results.showcase is None:
            raise InputError(f"{self.run}: keeps no pictures; run the recording again with --rerun")
        with fresh_folder(self.out) as folder:
            table = results.table
            for drawn in report_figures(table, table.conditions(), results.showcase):
                save_picture(drawn.figure, folder, drawn.name)
                print(f"{drawn.name}.png: {drawn.title}")
            if self.animation:
                self._animate(folder, results.showcase)

    def _animate(self, folder: Path, showcase: Showcase) -> None:
        from evaluation.show.figures.landing import save_landing

        if showcase.T_ground_mav is None:
            raise InputError(f"{self.run}: --animation: its surface was not aligned")
        save_landing(folder / "landing.webp", showcase, showcase.T_ground_mav)
        print("landing.webp: the first aerial surface finds its place")
