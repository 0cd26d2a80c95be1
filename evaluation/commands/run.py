"""`airground run`: one recording through the pipeline."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from evaluation.commands.words import OutWord, SeedWord, SetupWords, Verb


@dataclass(frozen=True, kw_only=True)
class Run(Verb, SetupWords, SeedWord, OutWord):
    """Run the pipeline over a recording and measure it against the truth.

    Leaves the augmented map and both robots' paths beside the measurements and the report.
    """

    recording: Annotated[Positional[Path], arg(metavar="RECORDING")]
    """A folder that simulate has written."""

    def main(self) -> None:
        from airground.io.ply import write_ply
        from airground.io.recording import Recording
        from airground.io.tum import write_tum
        from evaluation.output import fresh_folder
        from evaluation.results_folder import Results
        from evaluation.run import run_recording
        from evaluation.screen import print_summary
        from sim.truth import Truth

        setup, seed = self.setup(), self.checked_seed()
        with fresh_folder(self.out) as folder:
            recording = Recording.open(self.recording)
            result = run_recording(recording, Truth.open(self.recording), setup, seed)
            augmented = result.augmented
            write_ply(folder / "augmented_map.ply", augmented.cloud_ground, augmented.sources)
            for name, path in (("mav", result.mav), ("ground", result.ground)):
                if path is not None:
                    write_tum(folder / f"{name}_camera.tum", path)
            summary = Results(result.table, setup.config, seed).write(folder)
        print_summary(summary)
