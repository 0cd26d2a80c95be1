"""Options for recordings of others: folders and bags, and what they do not state."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from tyro.conf import UseAppendAction

from airground.errors import InputError
from evaluation.commands.options import Shown

if TYPE_CHECKING:
    from airground.core.cloud import Source
    from airground.io.robot_recording import Pair, RobotRecording


@dataclass(frozen=True, kw_only=True)
class FolderOptions:
    """What a folder or bag of others does not state."""

    heading: ClassVar[str] = "input"

    calibration: Annotated[Path | None, Shown("FILE", "the folder's own")] = None
    """camera calibration (EuRoC's sensor.yaml)"""
    depth_scale: Annotated[float | None, Shown("N", "the format's own")] = None
    """value of one metre in depth: 1000 or 5000"""
    topics: Annotated[UseAppendAction[tuple[str, ...]], Shown("ROLE=TOPIC ...", "by type")] = ()
    """of a bag: image, depth, info, imu, magnetic; or =none"""

    def open(self, path: Path, robot: Source) -> RobotRecording[Any]:
        """The recording of one robot.

        Raises:
            InputError: It cannot be read, or an option is wrong.
        """
        from airground.io.open_recording import open_robot

        return open_robot(
            path,
            robot,
            self.calibration,
            depth_units_per_m=checked_scale("--depth-scale", self.depth_scale),
            topics=topics_by_role("--topics", self.topics),
        )


@dataclass(frozen=True, kw_only=True)
class OwnRecordings:
    """Recordings of two robots from anywhere."""

    heading: ClassVar[str] = "your own recordings, in place of RECORDING"

    mav: Annotated[Path | None, Shown("DIR")] = None
    """the MAV's folder (EuRoC, TUM RGB-D, 7-Scenes) or ROS bag"""
    ground: Annotated[Path | None, Shown("DIR")] = None
    """the ground robot's folder (TUM RGB-D, 7-Scenes) or ROS bag"""
    mav_calibration: Annotated[Path | None, Shown("FILE", "the folder's own")] = None
    """camera calibration (EuRoC's sensor.yaml)"""
    ground_calibration: Annotated[Path | None, Shown("FILE", "the folder's own")] = None
    """camera calibration in the same form"""
    ground_depth_scale: Annotated[float | None, Shown("N", "the format's own")] = None
    """value of one metre in depth: 1000 or 5000"""
    mav_topics: Annotated[UseAppendAction[tuple[str, ...]], Shown("ROLE=TOPIC ...", "by type")] = ()
    """of its bag: image, info, imu, magnetic; or =none"""
    ground_topics: Annotated[
        UseAppendAction[tuple[str, ...]], Shown("ROLE=TOPIC ...", "by type")
    ] = ()
    """of its bag: the same, and depth"""

    def given_any(self) -> bool:
        """Whether any of these options is given."""
        folders = (self.mav, self.ground, self.mav_calibration, self.ground_calibration)
        return any((*folders, self.ground_depth_scale, self.mav_topics, self.ground_topics))

    def pair(self, mav: Path, ground: Path) -> Pair:
        """Both recordings.

        Raises:
            InputError: One of them cannot be read, or an option is wrong.
        """
        from airground.core.cloud import Source
        from airground.io.open_recording import open_robot
        from airground.io.robot_recording import Pair

        return Pair(
            open_robot(
                mav,
                Source.MAV,
                self.mav_calibration,
                topics=topics_by_role("--mav-topics", self.mav_topics),
            ),
            open_robot(
                ground,
                Source.GROUND,
                self.ground_calibration,
                depth_units_per_m=checked_scale("--ground-depth-scale", self.ground_depth_scale),
                topics=topics_by_role("--ground-topics", self.ground_topics),
            ),
        )


def checked_scale(word: str, value: float | None) -> float | None:
    """The value of one metre in depth images, if it is one.

    Raises:
        InputError: It is not positive.
    """
    if value is not None and not (math.isfinite(value) and value > 0):
        raise InputError(f"{word} {value:g}: must be positive; usual are 1000 and 5000 per metre")
    return value


def topics_by_role(word: str, given: tuple[str, ...]) -> dict[str, str]:
    """Topics by role, from words such as image=/camera/image_raw.

    Raises:
        InputError: A word is none, or a role is there twice.
    """
    found: dict[str, str] = {}
    for pair in given:
        role, _, topic = pair.partition("=")
        if not topic or role in found:
            raise InputError(f"{word} {pair}: expected ROLE=TOPIC, each role once")
        found[role] = topic
    return found
