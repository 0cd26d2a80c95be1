"""The whole pipeline over a recording in one call: what `import airground` offers for it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np

from airground.augmentation import AugmentedMap
from airground.config import Config
from airground.core.events import Aligned, Event
from airground.core.messages import RobotCalibration, Stamped
from airground.core.se3 import SE3
from airground.pipeline import Pipeline
from airground.slam.front_ends import GROUND, MAV, Ingredients, make_front_end
from airground.tracking import FrontEnds, Trackers


class OneRobot(Protocol):
    """One robot's part of a recording, as far as a run needs it."""

    @property
    def calibration(self) -> RobotCalibration:
        """Nominal calibration of the robot."""


class TwoRobots(Protocol):
    """A recording of both robots, as far as a run needs it; `open_recording` returns one."""

    @property
    def mav(self) -> OneRobot:
        """The MAV's part."""

    @property
    def ground(self) -> OneRobot:
        """The ground robot's part."""

    def messages(self) -> Iterator[Stamped]:
        """Every message of both robots in order of time."""


class Run:
    """The pipeline of Figure 4 over one recording; iterate over it once, for its events.

    Args:
        recording: Recording of both robots.
        config: The pipeline's parameters.
        seed: Seed of all random numbers: the same seed gives the same events.
        T_ground_mav_prior: Prior pose that replaces the global search (Sec. III).

    Attributes:
        pipeline: All stages above tracking.
        T_ground_mav: Newest accepted alignment; None before the first.
    """

    def __init__(
        self,
        recording: TwoRobots,
        config: Config | None = None,
        seed: int = 0,
        T_ground_mav_prior: SE3 | None = None,
    ) -> None:
        config = Config() if config is None else config
        tracking_rng, pipeline_rng = np.random.default_rng(seed).spawn(2)
        mav, ground = recording.mav.calibration, recording.ground.calibration
        self._recording = recording
        self._trackers = slam_trackers(mav, ground, config, tracking_rng)
        self.pipeline = Pipeline(config, mav, ground, pipeline_rng, T_ground_mav_prior)
        self.T_ground_mav: SE3 | None = None

    def __iter__(self) -> Iterator[Event]:
        frames = self._trackers.frames(self._recording.messages())
        for event in self.pipeline.run(frames):
            if isinstance(event, Aligned) and event.alignment.accepted:
                self.T_ground_mav = event.alignment.T_ground_mav
            yield event
        self.pipeline.mapping.correct_ground(self._trackers.finish())

    def augmented_map(self) -> AugmentedMap:
        """The ground map with everything that was aligned so far."""
        return self.pipeline.augmented_map()


def run(
    recording: TwoRobots,
    config: Config | None = None,
    seed: int = 0,
    T_ground_mav_prior: SE3 | None = None,
) -> Run:
    """The pipeline over a recording: an iterable of its events, with the map at the end.

    Args:
        recording: Recording of both robots, from `open_recording`.
        config: The pipeline's parameters; the preset `best` by default.
        seed: Seed of all random numbers: the same seed gives the same events.
        T_ground_mav_prior: Prior pose that replaces the global search (Sec. III).

    Raises:
        InputError: While iterating: an image cannot be read.
    """
    return Run(recording, config, seed, T_ground_mav_prior)


def slam_trackers(
    mav: RobotCalibration, ground: RobotCalibration, config: Config, rng: np.random.Generator
) -> Trackers:
    """Trackers of both robots by SLAM (Sec. IV), for messages from anywhere.

    Args:
        mav, ground: Nominal calibration of each robot.
        config: The pipeline's parameters.
        rng: Source of the samples of outlier rejection.
    """
    mav_rng, ground_rng = rng.spawn(2)
    front_ends = FrontEnds(
        mav=make_front_end(MAV, "slam", Ingredients(mav, config, mav_rng)),
        ground=make_front_end(GROUND, "slam", Ingredients(ground, config, ground_rng)),
    )
    return Trackers(mav, ground, front_ends)
