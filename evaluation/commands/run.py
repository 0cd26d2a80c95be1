"""`airground run`: both robots through the whole pipeline, measured."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from tyro.conf import Positional

from airground.errors import InputError
from evaluation.commands.folder_options import OwnRecordings
from evaluation.commands.options import (
    RUN_S_PER_S,
    START_S,
    OutOption,
    PipelineOptions,
    SeedOption,
    Shown,
    Verb,
    recorded,
)
from evaluation.commands.sections import SLAM, USED

if TYPE_CHECKING:
    from airground.config import Config
    from airground.io.recording import Recording
    from airground.io.robot_recording import Pair
    from evaluation.judge.summary import Summary
    from evaluation.measure.baselines.claims import BaselineClaims
    from evaluation.measure.showcase import Showcase
    from evaluation.run.drops import DropList
    from evaluation.run.onlooker import Onlooker
    from evaluation.run.recording import RunResult
    from evaluation.setup.settings import RerunLevel
    from evaluation.setup.setups import Given, Setup
    from sim.recording.truth import Truth

logger = logging.getLogger(__name__)

DROPPED = "dropped.json"


@dataclass(frozen=True, kw_only=True)
class GivenResults:
    """Results of other systems in place of a stage."""

    heading: ClassVar[str] = "results of other systems, in place of a stage"

    mav_trajectory: Annotated[Path | None, Shown("FILE")] = None
    """the MAV's SLAM: TUM file of camera poses, metric with z up"""
    ground_trajectory: Annotated[Path | None, Shown("FILE")] = None
    """the ground robot's SLAM: the same"""
    ground_map: Annotated[Path | None, Shown("FILE")] = None
    """its map: PLY file in the frame of --ground-trajectory"""

    def given(self) -> Given:
        """The results, read.

        Raises:
            InputError: A file cannot be used, or the map has no poses in its frame.
        """
        from airground.io.tum import read_tum
        from evaluation.run.given_map import read_map
        from evaluation.setup.setups import Given

        if self.ground_map is not None and self.ground_trajectory is None:
            raise InputError(
                "--ground-map: needs --ground-trajectory, poses of the ground robot's camera in "
                "the frame of that map"
            )
        return Given(
            mav=read_tum(self.mav_trajectory) if self.mav_trajectory else None,
            ground=read_tum(self.ground_trajectory) if self.ground_trajectory else None,
            ground_map=read_map(self.ground_map) if self.ground_map else None,
        )


@dataclass(frozen=True, kw_only=True)
class RerunOptions:
    """What is drawn of a run."""

    heading: ClassVar[str] = "output"

    rerun: bool = False
    """also write run.rrd for view, and the pictures for gallery"""
    rerun_live: bool = False
    """as --rerun, and show the run in a window or a browser"""

    @property
    def draws(self) -> bool:
        """Whether anything is drawn."""
        return self.rerun or self.rerun_live

    @contextmanager
    def watching(
        self,
        folder: Path,
        name: str,
        recording: Pair,
        truth: Truth | None,
        config: Config,
        level: RerunLevel,
    ) -> Iterator[list[Onlooker]]:
        """The onlookers that draw a run into a folder; none where it was not asked for."""
        if not self.draws:
            yield []
            return
        from airground.core.cloud import Source
        from evaluation.show.rerun_view.run_view import RUN_FILE, RunView

        with ExitStack() as stack:
            viewer = stack.enter_context(_viewer()) if self.rerun_live else None
            calibrations = {robot: recording.of(robot).calibration for robot in Source}
            stamps = [recording.of(robot).camera_stamps for robot in Source]
            times_ns = int(min(s[0] for s in stamps)), int(max(s[-1] for s in stamps))
            view = RunView(
                folder / RUN_FILE, name, calibrations, truth, config, times_ns, level, viewer
            )
            stack.callback(view.close)
            yield [view]


@dataclass(frozen=True, kw_only=True)
class Run(OwnRecordings, GivenResults, RerunOptions, PipelineOptions, SeedOption, OutOption, Verb):
    """Run the pipeline over a recording and measure it against the truth."""

    sections: ClassVar[tuple[str, ...]] = USED["run"]

    recording: Annotated[Positional[Path | None], Shown("RECORDING")] = None
    """folder that simulate has written, with its truth or sealed"""
    drops: Annotated[Path | None, Shown("FILE")] = None
    """leave out the images that a live run dropped (its dropped.json)"""
    baselines: bool = False
    """also leave claims of baselines, for submit --baselines"""

    def idle(self, section: str, key: str) -> str:
        if section == "rerun" and not self.draws:
            return "nothing is drawn without --rerun"
        given = {
            SLAM["mav"]: self.mav_trajectory,
            SLAM["ground"]: self.ground_trajectory,
            "ground_mapping": self.ground_map,
        }
        file = given.get(section)
        # The augmented map has its voxels, whoever made the ground robot's map.
        if file is not None and (section, key) != ("ground_mapping", "voxel_m"):
            return f"{file} is given in place of this stage"
        return super().idle(section, key)

    def main(self) -> None:
        from airground.io.recording import Recording

        match self.recording, self.mav, self.ground:
            case Path() as recording, *_ if not self.given_any():
                if is_sealed(recording):
                    self._run_pair(partial(Recording.open, recording), recording.resolve().name)
                else:
                    self._run_simulated(recording)
            case None, Path() as mav, Path() as ground:
                self._run_pair(partial(self.pair, mav, ground), f"{mav.name}, {ground.name}")
            case _:
                raise InputError(
                    "give either RECORDING, or both --mav DIR and --ground DIR (with which alone "
                    "--mav-calibration, --ground-calibration, --ground-depth-scale, --mav-topics "
                    "and --ground-topics go)"
                )

    def _run_simulated(self, path: Path) -> None:
        from evaluation.measure.close_up import CloseUp
        from evaluation.run.drops import DropList, nothing_dropped
        from evaluation.run.own_recordings import warn_of_silence
        from evaluation.run.recording import run_recording
        from evaluation.setup.output import fresh_folder
        from evaluation.setup.progress import announce
        from evaluation.show.report.screen import print_summary

        setup = self._setup_with("" if self.drops is None else "with frames left out")
        level, seed = self.settings().rerun.level, self.checked_seed()
        with fresh_folder(self.out) as folder:
            recording, truth = simulated(path)
            drops = nothing_dropped(recording)
            if self.drops is not None:
                drops = DropList.read(self.drops, recording)
            seconds = recording.duration_s
            announce(f"runs {recorded(path, seconds)}", START_S + seconds * RUN_S_PER_S)
            close_up = CloseUp(recording, truth, setup) if self.draws else None
            name = recording.path.name
            with self.watching(folder, name, recording, truth, setup.config, level) as onlookers:
                if close_up is not None:
                    onlookers.append(close_up)
                baselines = self._baselines(setup, seed, onlookers)
                result = run_recording(recording, truth, setup, seed, drops, onlookers, apart=True)
            if baselines is not None:
                baselines.write(folder, result.tracked)
            showcase = (
                None if close_up is None else close_up.showcase(result.tracked, result.augmented)
            )
            summary = write_measured(folder, recording, result, drops, setup, seed, showcase)
        print_summary(summary)
        warn_of_silence(recording.mav, recording.ground)

    def _run_pair(self, opened: Callable[[], Pair], name: str) -> None:
        """Run without truth over what `opened` gives, once the output folder is made."""
        from evaluation.run.own_pair import print_pair, run_pair, write_pair
        from evaluation.run.own_recordings import warn_of_silence
        from evaluation.setup.output import fresh_folder
        from evaluation.setup.progress import announce
        from evaluation.setup.settings import write_config
        from evaluation.show.report.pair_page import write_pair_page

        for word, needs in (("--drops", self.drops), ("--poses oracle", self.poses == "oracle")):
            if needs:
                raise InputError(f"{word}: needs a recording of simulate with its truth")
        setup = self._setup_with("")
        level, seed = self.settings().rerun.level, self.checked_seed()
        with fresh_folder(self.out) as folder:
            pair = opened()
            seconds = max(pair.mav.duration_s, pair.ground.duration_s)
            announce(f"runs {recorded(name, seconds)}", START_S + seconds * RUN_S_PER_S)
            with self.watching(folder, name, pair, None, setup.config, level) as onlookers:
                baselines = self._baselines(setup, seed, onlookers)
                result = run_pair(pair, setup, seed, onlookers)
            if baselines is not None:
                baselines.write(folder, result.tracked)
            summary = write_pair(folder, pair, setup, result)
            write_config(setup.config, folder / "config.toml")
            write_pair_page(folder, name, summary, result)
        print_pair(summary)
        warn_of_silence(pair.mav, pair.ground)

    def _baselines(
        self, setup: Setup, seed: int, onlookers: list[Onlooker]
    ) -> BaselineClaims | None:
        """The baselines, as one more onlooker where they were asked for."""
        if not self.baselines:
            return None
        from evaluation.measure.baselines.claims import BaselineClaims

        asked = BaselineClaims(setup.config, seed)
        for name, reason in asked.missing.items():
            logger.warning("baseline %s is left out: %s", name, reason)
        onlookers.append(asked)
        return asked

    def _setup_with(self, variant: str) -> Setup:
        """The setup with the given results, which its variant names."""
        from evaluation.setup.setups import NOTHING

        setup, given = self.setup(), self.given()
        replaced = given.describe()
        if replaced and setup.poses != "slam":
            raise InputError("--poses oracle: without files that replace a stage")
        words = ", ".join(filter(None, (variant, replaced)))
        return replace(setup, given=given if replaced else NOTHING, variant=words)


def is_sealed(path: Path) -> bool:
    """Whether it is a recording of simulate whose truth is elsewhere."""
    from airground.io.layout import HEADER, TRUTH

    return (path / HEADER).is_file() and not (path / TRUTH).exists()


def simulated(path: Path) -> tuple[Recording, Truth]:
    """A recording that simulate has written, with its truth.

    Raises:
        AirgroundError: It is none; names the verb that takes it where there is one.
    """
    from airground.io.layout import HEADER
    from airground.io.recording import Recording
    from sim.recording.truth import Truth

    if path.is_dir() and not (path / HEADER).exists():
        raise InputError(
            f"{path}: has no {HEADER}; expected a recording that simulate has written "
            "(of others' folders, track takes one robot's, run --mav DIR --ground DIR two)"
        )
    recording = Recording.open(path)
    return recording, Truth.open(recording.path)


def write_measured(
    folder: Path,
    recording: Recording,
    result: RunResult,
    drops: DropList,
    setup: Setup,
    seed: int,
    showcase: Showcase | None = None,
) -> Summary:
    """Write what a run of both robots leaves; returns its summary."""
    from evaluation.judge.results import Results
    from evaluation.run.recording import write_run
    from evaluation.setup.progress import step
    from evaluation.show.report.page import write_results

    with step("writing the report"):
        write_run(folder, recording, result)
        drops.write(folder / DROPPED)
        return write_results(Results(result.table, setup.config, seed, showcase), folder)


@contextmanager
def _viewer() -> Iterator[str]:
    """A viewer that waits for data; gives its address."""
    from evaluation.show.rerun_view import viewer

    ports = viewer.free_ports()
    if viewer.has_screen():
        with viewer.window(ports):
            yield ports.sink
        return
    with viewer.serving(ports):
        print(f"live in a browser: {ports.page}")
        yield ports.sink
