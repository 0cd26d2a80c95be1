"""`airground run --mav DIR --ground DIR`, and what replaces a stage: data of one's own."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from airground.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from contextlib import AbstractContextManager

    from airground.core.cloud import Source
    from airground.core.messages import RobotCalibration
    from evaluation.run.onlooker import Onlooker
    from evaluation.setup.setups import Given, Setup
    from sim.recording.truth import Truth

    Watching = Callable[
        [Path, str, Mapping[Source, RobotCalibration], Truth | None],
        AbstractContextManager[Sequence[Onlooker]],
    ]
    """Who watches a run: of a folder to draw into, a name, both robots' lenses, what is true."""

_OPTIONAL = "(optional)"


@dataclass(frozen=True, kw_only=True)
class OwnWords:
    """Recordings of two robots from anywhere, and results of other systems."""

    mav: Annotated[Path | None, arg(metavar="DIR", help_behavior_hint=_OPTIONAL)] = None
    """With --ground, in place of RECORDING: the MAV's EuRoC folder."""
    ground: Annotated[Path | None, arg(metavar="DIR", help_behavior_hint=_OPTIONAL)] = None
    """With --mav, in place of RECORDING: the ground robot's TUM RGB-D folder."""
    mav_calibration: Annotated[
        Path | None, arg(metavar="FILE", help_behavior_hint="(default: the folder's own)")
    ] = None
    """With --mav: its camera's calibration, in the form of EuRoC's sensor.yaml."""
    ground_calibration: Annotated[
        Path | None, arg(metavar="FILE", help_behavior_hint="(default: the folder's own)")
    ] = None
    """With --ground: its camera's calibration, likewise."""
    mav_trajectory: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint=_OPTIONAL)] = None
    """In place of the MAV's SLAM: a TUM file of its camera's poses, metric with z up."""
    ground_trajectory: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint=_OPTIONAL)] = (
        None
    )
    """In place of the ground robot's SLAM: likewise."""
    ground_map: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint=_OPTIONAL)] = None
    """In place of the ground robot's map: a PLY file in the frame of --ground-trajectory."""

    def check_own_words(self, recording: Path | None, alone: bool, realtime: bool) -> None:
        """Raises InputError where a word has no meaning."""
        both = self.mav is not None and self.ground is not None
        if (recording is None) != both or (self.mav is None) != (self.ground is None):
            raise InputError(
                "give either RECORDING, or both --mav DIR and --ground DIR; for one robot "
                "alone RECORDING and --only"
            )
        if not both and (self.mav_calibration or self.ground_calibration):
            raise InputError(
                "--mav-calibration and --ground-calibration: only with --mav, --ground"
            )
        if self.ground_map is not None and self.ground_trajectory is None:
            raise InputError(
                "--ground-map: needs --ground-trajectory, poses of the ground robot's camera in "
                "the frame of that map"
            )
        if (alone or realtime) and (both or self.replaces()):
            raise InputError(
                "--mav, --ground, --mav-trajectory, --ground-trajectory and --ground-map: without "
                "--only, --realtime and --drops"
            )

    def replaces(self) -> bool:
        """Whether a stage is replaced."""
        given = (self.mav_trajectory, self.ground_trajectory, self.ground_map)
        return any(path is not None for path in given)

    def run_own(self, out: Path, setup: Setup, seed: int, watching: Watching) -> None:
        """Run both folders, write what came out, and print a summary."""
        from airground.core.cloud import Source
        from airground.io.open_recording import open_robot
        from airground.io.robot_recording import Pair
        from evaluation.run.own_recordings import print_pair, run_pair, write_pair
        from evaluation.setup.output import fresh_folder
        from evaluation.setup.settings import write_config

        assert self.mav is not None
        assert self.ground is not None
        if setup.poses != "slam":
            raise InputError("--poses oracle: needs a recording that simulate has written")
        with fresh_folder(out) as folder:
            pair = Pair(
                open_robot(self.mav, Source.MAV, self.mav_calibration),
                open_robot(self.ground, Source.GROUND, self.ground_calibration),
            )
            name = f"{self.mav.name}, {self.ground.name}"
            calibrations = {robot: pair.of(robot).calibration for robot in Source}
            with watching(folder, name, calibrations, None) as onlookers:
                result = run_pair(pair, setup, seed, onlookers)
            summary = write_pair(folder, pair, setup, result)
            write_config(setup.config, folder / "config.toml")
        print_pair(summary)

    def with_given(self, setup: Setup) -> Setup:
        """The setup with what the user brings along, named in its variant."""
        if not self.replaces():
            return setup
        if setup.poses != "slam":
            raise InputError("--poses oracle: without files that replace a stage")
        given = self._given()
        variant = ", ".join(filter(None, (setup.variant, given.describe())))
        return replace(setup, given=given, variant=variant)

    def _given(self) -> Given:
        from airground.io.tum import read_tum
        from evaluation.run.given_map import read_map
        from evaluation.setup.setups import Given

        return Given(
            mav=read_tum(self.mav_trajectory) if self.mav_trajectory else None,
            ground=read_tum(self.ground_trajectory) if self.ground_trajectory else None,
            ground_map=read_map(self.ground_map) if self.ground_map else None,
        )
