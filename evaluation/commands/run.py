"""`airground run`: one recording through the pipeline."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from airground.errors import InputError
from evaluation.commands.alone import AloneWords
from evaluation.commands.words import OutWord, SeedWord, SetupWords, Verb


@dataclass(frozen=True, kw_only=True)
class Run(Verb, AloneWords, SetupWords, SeedWord, OutWord):
    """Run the pipeline over a recording and measure it against the truth.

    Leaves the augmented map and both robots' paths beside the measurements and the report.
    With --only it tracks one robot, and leaves its trajectory.
    """

    recording: Annotated[Positional[Path], arg(metavar="RECORDING")]
    """A folder that simulate has written."""

    def main(self) -> None:
        self.check_alone_words()
        if self.only is not None:
            self.run_one(self.recording, self.out, self.resolved_config(), self.checked_seed())
        else:
            self._run_both()

    def _run_both(self) -> None:
        from airground.io.layout import HEADER
        from airground.io.ply import write_ply
        from airground.io.recording import Recording
        from evaluation.output import fresh_folder
        from evaluation.results_folder import Results
        from evaluation.run import run_recording, write_trajectories
        from evaluation.screen import print_summary
        from sim.truth import Truth

        if self.recording.is_dir() and not (self.recording / HEADER).exists():
            raise InputError(
                f"{self.recording}: has no {HEADER}; both robots run from a recording that "
                "simulate has written, one alone from EuRoC or TUM RGB-D with --only"
            )
        setup, seed = self.setup(), self.checked_seed()
        with fresh_folder(self.out) as folder:
            recording = Recording.open(self.recording)
            result = run_recording(recording, Truth.open(self.recording), setup, seed)
            augmented = result.augmented
            write_ply(folder / "augmented_map.ply", augmented.cloud_ground, augmented.sources)
            write_trajectories(folder, recording, result.tracked)
            summary = Results(result.table, setup.config, seed).write(folder)
        print_summary(summary)
