"""`airground export`: a recording in another format."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from evaluation.commands.words import OutWord, Verb


@dataclass(frozen=True, kw_only=True)
class Export(Verb, OutWord):
    """Write a recording, with its truth, in a format that other tools read.

    docs/datasets.md says for each format what lies where, in which axes and units.
    """

    recording: Annotated[Positional[Path], arg(metavar="RECORDING")]
    """A folder that simulate has written."""
    format: Literal["tum", "euroc", "mcap", "nerfstudio", "colmap"]
    """What to write: tum is of the ground robot, euroc of the MAV, others of either."""
    robot: Annotated[
        Literal["mav", "ground", "both"] | None,
        arg(metavar="{mav,ground,both}", help_behavior_hint="(default: what the format holds)"),
    ] = None
    """Whose sensors."""

    def main(self) -> None:
        from evaluation.datasets.formats import FORMATS, robots_for
        from evaluation.datasets.simulated import Simulated
        from evaluation.setup.output import fresh_folder

        robots = robots_for(self.format, self.robot)
        with fresh_folder(self.out) as folder:
            FORMATS[self.format].write(folder, Simulated.open(self.recording), robots)
