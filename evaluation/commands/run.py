"""`airground run`: one recording through the pipeline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from airground.errors import InputError
from evaluation.commands.alone import AloneWords
from evaluation.commands.look import LookWords
from evaluation.commands.own import OwnWords
from evaluation.commands.realtime import RealtimeWords
from evaluation.commands.words import OutWord, SeedWord, SetupWords, Verb

if TYPE_CHECKING:
    from airground.io.recording import Recording
    from evaluation.run.drops import DropList
    from evaluation.run.onlooker import Onlooker
    from evaluation.run.recording import RunResult
    from evaluation.setup.setups import Setup
    from sim.recording.truth import Truth

DROPPED = "dropped.json"


@dataclass(frozen=True, kw_only=True)
class Run(Verb, OwnWords, AloneWords, RealtimeWords, LookWords, SetupWords, SeedWord, OutWord):
    """Run the pipeline over a recording and measure it against the truth.

    Leaves the augmented map and both robots' paths beside the measurements and the report.
    With --only it tracks one robot, and leaves its trajectory. With --realtime the recording
    is played at its own rate, and dropped.json says which frames were too many. With --mav and
    --ground both robots' recordings are one's own, and what is measured needs no truth. With
    --rerun it leaves run.rrd, which `airground view` opens.
    """

    recording: Annotated[
        Positional[Path | None],
        arg(metavar="RECORDING", help_behavior_hint="(or --mav and --ground)"),
    ] = None
    """A folder that simulate has written."""

    def main(self) -> None:
        self.check_alone_words()
        self.check_realtime_words(self.only)
        live = self.realtime or self.drops is not None
        self.check_own_words(self.recording, self.only is not None, live)
        self.check_look_words(self.only is not None, self.realtime)
        if self.recording is None:
            setup, seed = self.with_given(self.setup()), self.checked_seed()
            self.run_own(self.out, setup, seed, self.watching)
        elif self.only is not None:
            self.run_one(self.recording, self.out, self.resolved_config(), self.checked_seed())
        else:
            self._run_both(self.recording)

    def _run_both(self, path: Path) -> None:
        from airground.core.cloud import Source
        from airground.io.layout import HEADER
        from airground.io.recording import Recording
        from evaluation.judge.results import Results
        from evaluation.measure.close_up import CloseUp
        from evaluation.run.recording import write_run
        from evaluation.setup.output import fresh_folder
        from evaluation.show.report.page import write_results
        from evaluation.show.report.screen import print_summary
        from sim.recording.truth import Truth

        if path.is_dir() and not (path / HEADER).exists():
            raise InputError(
                f"{path}: has no {HEADER}; both robots run from a recording that simulate has "
                "written, or from --mav and --ground, one alone from EuRoC or TUM RGB-D with --only"
            )
        setup = self.with_given(replace(self.setup(), variant=self.variant()))
        seed = self.checked_seed()
        with fresh_folder(self.out) as folder:
            recording = Recording.open(path)
            truth = Truth.open(recording.path)
            closeup = CloseUp(recording, truth, setup) if self.looks else None
            calibrations = {robot: recording.of(robot).calibration for robot in Source}
            with self.watching(folder, recording.path.name, calibrations, truth) as onlookers:
                if closeup is not None:
                    onlookers.append(closeup)
                result, drops = self._result(recording, truth, setup, seed, onlookers)
            write_run(folder, recording, result)
            drops.write(folder / DROPPED)
            showcase = (
                None if closeup is None else closeup.showcase(result.tracked, result.augmented)
            )
            summary = write_results(Results(result.table, setup.config, seed, showcase), folder)
        print_summary(summary)

    def _result(
        self,
        recording: Recording,
        truth: Truth,
        setup: Setup,
        seed: int,
        onlookers: Sequence[Onlooker],
    ) -> tuple[RunResult, DropList]:
        """What the run leaves, and which frames it did without."""
        from evaluation.run.drops import DropList, nothing_dropped
        from evaluation.run.live.live_run import run_live
        from evaluation.run.recording import run_recording

        if self.realtime:
            return run_live(recording, truth, setup, seed, self.playback())
        drops = nothing_dropped(recording)
        if self.drops is not None:
            drops = DropList.read(self.drops, recording)
        return run_recording(recording, truth, setup, seed, drops, onlookers, apart=True), drops
