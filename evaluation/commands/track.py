"""`airground track`: one robot alone, through one front end or several."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from tyro.conf import Positional

from airground.errors import InputError
from evaluation.commands.folder_options import FolderOptions
from evaluation.commands.options import (
    START_S,
    TRACK_S_PER_S,
    ConfigOptions,
    OutOption,
    SeedOption,
    Shown,
    Verb,
    recorded,
)
from evaluation.commands.sections import SLAM, USED

if TYPE_CHECKING:
    from airground.core.cloud import Source
    from airground.io.robot_recording import RobotRecording
    from airground.slam.front_end import FrontEnd


@dataclass(frozen=True, kw_only=True)
class Track(FolderOptions, ConfigOptions, SeedOption, OutOption, Verb):
    """Track one robot alone, with one front end or several.

    Leaves the trajectory and a summary; with several front ends one folder for each, and a
    picture of their errors beside each other where the truth is known.
    """

    folder: Annotated[Positional[Path], Shown("FOLDER")]
    """simulate's recording, EuRoC (MAV), TUM RGB-D or 7-Scenes (ground robot), or a ROS bag"""
    robot: Annotated[Literal["mav", "ground"] | None, Shown("{mav,ground}", "by the layout")] = None
    """which one, for a recording of simulate or a bag"""
    front_end: Annotated[tuple[str, ...], Shown("NAME ...", "slam")] = ()
    """slam, file, and for the ground robot open3d and opencv"""
    trajectory: Annotated[Path | None, Shown("FILE")] = None
    """poses for the front end file: TUM, of the camera, metric, z up"""

    sections: ClassVar[tuple[str, ...]] = USED["track"]

    def idle(self, section: str, key: str) -> str:
        if section not in self.sections:
            return super().idle(section, key)
        if "slam" not in self._names():
            return f"only slam has parameters; the front end is {', '.join(self._names())}"
        mine = SLAM[self._source().name.lower()]
        return "" if section == mine else f"the SLAM of this robot uses section {mine}"

    def main(self) -> None:
        from evaluation.run.own_recordings import (
            print_alone,
            run_alone,
            warn_of_silence,
            write_alone,
        )
        from evaluation.setup.output import fresh_folder
        from evaluation.setup.progress import announce
        from evaluation.show.figures.front_ends import draw_front_ends
        from evaluation.table.true_camera import true_camera

        names, robot = self._names(), self._source()
        self._check_used(names, robot)
        with fresh_folder(self.out) as out:
            recording = self.open(self.folder, robot)
            true_pose = true_camera(recording)
            front_ends = {name: self._front_end(name, recording) for name in names}
            seconds = recording.duration_s
            what = f"tracks {recorded(self.folder, seconds)} with {', '.join(names)}"
            announce(what, START_S + len(names) * seconds * TRACK_S_PER_S)
            results, summaries = {}, []
            for name, front_end in front_ends.items():
                results[name] = run_alone(recording, front_end)
                folder = out if len(names) == 1 else out / name
                folder.mkdir(exist_ok=True)
                summaries.append(write_alone(folder, recording, name, results[name], true_pose))
            untracked = [one["why_untracked"] for one in summaries if one["why_untracked"]]
            if len(untracked) == len(names):
                raise InputError(untracked[0])
            if len(names) > 1:
                draw_front_ends(out, recording, results, true_pose)
        for summary in summaries:
            print_alone(summary)
        warn_of_silence(recording)

    def _check_used(self, names: list[str], robot: Source) -> None:
        """InputError if an option would change nothing."""
        for word, given in (("--preset", self.preset), ("--config", self.config)):
            if given is not None and "slam" not in names:
                raise InputError(
                    f"{word} {given}: only slam has parameters; the front end is {', '.join(names)}"
                )
        if self.depth_scale is not None and robot.name == "MAV":
            raise InputError("--depth-scale: the MAV has no depth images; leave it out")
        self.settings()

    def _names(self) -> list[str]:
        """The front ends, each once; a trajectory asks for the front end that follows it."""
        names = self.front_end or (() if self.trajectory else ("slam",))
        return list(dict.fromkeys([*names, *(("file",) if self.trajectory else ())]))

    def _source(self) -> Source:
        """The robot to track.

        Raises:
            InputError: The layout does not say which.
        """
        from airground.core.cloud import Source
        from airground.io.header import read_header
        from airground.io.layout import HEADER
        from airground.io.open_recording import layout_of

        if self.robot is not None:
            return Source[self.robot.upper()]
        match layout_of(self.folder):
            case "airground":
                robots = read_header(self.folder / HEADER).frames.robots()
                if len(robots) == 1:
                    return Source[robots[0].upper()]
                raise InputError(
                    f"{self.folder}: holds both robots; give --robot mav or --robot ground"
                )
            case "ros":
                raise InputError(
                    f"{self.folder}: is a bag; give --robot mav (images, IMU) or --robot ground "
                    "(colour and depth)"
                )
            case "tum" | "7scenes":
                return Source.GROUND
        return Source.MAV  # what opens the folder says what is wrong with it

    def _front_end(self, name: str, recording: RobotRecording[Any]) -> FrontEnd[Any]:
        import numpy as np

        from airground.io.tum import read_tum
        from evaluation.run.front_ends import named_front_end

        rng = np.random.default_rng(self.checked_seed())
        poses = None if self.trajectory is None else read_tum(self.trajectory)
        return named_front_end(recording, name, self.settings().pipeline(), rng, poses)
