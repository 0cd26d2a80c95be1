"""`airground run --only mav|ground`: one robot alone, from any folder that can be read."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import arg

from airground.errors import InputError

if TYPE_CHECKING:
    from airground.config import Config
    from airground.core.trajectory import Trajectory
    from airground.slam.front_end import FrontEnd


@dataclass(frozen=True, kw_only=True)
class AloneWords:
    """What is to be done with one robot alone."""

    only: Annotated[
        Literal["mav", "ground"] | None,
        arg(metavar="{mav,ground}", help_behavior_hint="(default: both, which must be ours)"),
    ] = None
    """Track one robot alone; RECORDING may then be a plain EuRoC or TUM RGB-D folder too."""
    front_end: Annotated[str, arg(metavar="NAME")] = "slam"
    """With --only: slam, file, and for the ground robot open3d or opencv."""
    calibration: Annotated[
        Path | None, arg(metavar="FILE", help_behavior_hint="(default: the folder's own)")
    ] = None
    """With --only: camera calibration of a plain folder, in the form of EuRoC's sensor.yaml."""
    trajectory: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(optional)")] = None
    """With --only and the front end file: a TUM file of camera poses, metric with z up."""

    def check_alone_words(self) -> None:
        """Raises InputError where a word has no meaning."""
        given = {"--calibration": self.calibration, "--trajectory": self.trajectory}
        for word, value in given.items():
            if value is not None and self.only is None:
                raise InputError(f"{word}: only with --only mav or --only ground")
        if self.front_end != "slam" and self.only is None:
            raise InputError("--front-end: only with --only mav or --only ground")
        if (self.front_end == "file") != (self.trajectory is not None):
            raise InputError("--front-end file and --trajectory FILE go together")

    def run_one(self, recording_path: Path, out: Path, config: Config, seed: int) -> None:
        """Track one robot, write its trajectory and a summary, and print the latter."""
        import numpy as np

        from airground.core.cloud import Source
        from airground.io.open_recording import open_robot
        from airground.slam import front_ends
        from evaluation.run.own_recordings import print_alone, run_alone, write_alone
        from evaluation.setup.output import fresh_folder
        from evaluation.table.true_camera import true_camera

        robot = Source.MAV if self.only == "mav" else Source.GROUND
        with fresh_folder(out) as folder:
            recording = open_robot(recording_path, robot, self.calibration)
            true_pose = true_camera(recording)
            given = front_ends.Ingredients(
                recording.calibration, config, np.random.default_rng(seed), self._poses()
            )
            front_end: FrontEnd[Any]
            if robot == Source.MAV:
                front_end = front_ends.make_front_end(front_ends.MAV, self.front_end, given)
            else:
                front_end = front_ends.make_front_end(front_ends.GROUND, self.front_end, given)
            result = run_alone(recording, front_end)
            summary = write_alone(folder, recording, self.front_end, result, true_pose)
        print_alone(summary)

    def _poses(self) -> Trajectory | None:
        from airground.io.tum import read_tum

        return None if self.trajectory is None else read_tum(self.trajectory)
