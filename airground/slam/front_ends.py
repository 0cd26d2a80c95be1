"""The front ends by name: a literal table for each robot.

To add one, write a class that fulfils `front_end.FrontEnd` and put a line here; the contract
test then runs it too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from airground.config import Config
from airground.core.messages import GroundImage, MavImage, RobotCalibration
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.slam.baselines.library_odometry import open3d_odometry, opencv_odometry
from airground.slam.baselines.trajectory_file import TrajectoryFile
from airground.slam.front_end import FrontEnd
from airground.slam.monocular import MonocularSlam
from airground.slam.rgbd import RgbdSlam


@dataclass(frozen=True)
class Ingredients:
    """Inputs of a front end.

    Attributes:
        calibration: Nominal calibration of the robot.
        config: The pipeline's configuration.
        rng: Source of the samples of outlier rejection.
        trajectory: Poses `T_map_camera` of an external system; None where there are none.
    """

    calibration: RobotCalibration
    config: Config
    rng: np.random.Generator
    trajectory: Trajectory | None = None

    def given_trajectory(self) -> Trajectory:
        """The trajectory; an InputError if there is none."""
        if self.trajectory is None:
            raise InputError("the front end 'file' needs a trajectory")
        return self.trajectory


MAV: dict[str, Callable[[Ingredients], FrontEnd[MavImage]]] = {
    "slam": lambda given: MonocularSlam(given.calibration, given.config, given.rng),
    "file": lambda given: TrajectoryFile(given.given_trajectory()),
}
"""Front ends of the MAV: grey images and IMU."""

GROUND: dict[str, Callable[[Ingredients], FrontEnd[GroundImage]]] = {
    "slam": lambda given: RgbdSlam(given.calibration, given.config, given.rng),
    "open3d": lambda given: open3d_odometry(given.calibration),
    "opencv": lambda given: opencv_odometry(given.calibration),
    "file": lambda given: TrajectoryFile(given.given_trajectory()),
}
"""Front ends of the ground robot: colour and depth."""

Image = TypeVar("Image", MavImage, GroundImage)


def make_front_end(
    table: dict[str, Callable[[Ingredients], FrontEnd[Image]]], name: str, given: Ingredients
) -> FrontEnd[Image]:
    """The front end called `name`.

    Raises:
        InputError: The name is unknown, or an input is missing.
    """
    if name not in table:
        raise InputError(f"--front-end {name}: unknown; known: {', '.join(table)}")
    return table[name](given)
