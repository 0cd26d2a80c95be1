"""`airground history`: accuracy over revisions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional

from evaluation.commands.options import OutOption, Shown, Verb
from evaluation.commands.results import ACCEPTED


@dataclass(frozen=True, kw_only=True)
class History(OutOption, Verb):
    """Draw accuracy over revisions: figures, intervals and steps, as a page and as JSON.

    Accepted figures are read with all their earlier versions in git. Folders of results follow
    in the order given.
    """

    sources: Annotated[
        Positional[tuple[Path, ...]], Shown("SOURCE ...", "evaluation/accepted.json")
    ] = (ACCEPTED,)
    """files of accept, folders of results, or folders of these"""

    def main(self) -> None:
        from evaluation.judge.history.points import read_points
        from evaluation.judge.history.series import history
        from evaluation.setup.output import fresh_folder
        from evaluation.setup.progress import step
        from evaluation.show.history.page import PAGE, conclusion, write_history

        found = history(read_points(self.sources))
        with fresh_folder(self.out) as folder, step("drawing the history"):
            write_history(folder, found)
        print(conclusion(found))
        print(self.out / PAGE)
