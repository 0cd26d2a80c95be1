"""The front ends of both robots under a setup: SLAM, an oracle, or a trajectory file."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.config import Config
from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.core.trajectory import Trajectory
from airground.io.recording import Recording
from airground.io.robot_recording import Pair, RobotRecording
from airground.slam.front_end import FrontEnd
from airground.slam.front_ends import GROUND, MAV, Ingredients, make_front_end
from airground.tracking import FrontEnds
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import Tracked, WatchedFrontEnd

if TYPE_CHECKING:
    from sim.recording.truth import Truth


@dataclass(frozen=True, eq=False)
class WatchedFrontEnds:
    """The front ends of both robots, with a log of their answers; `slam`: robots with SLAM."""

    mav: WatchedFrontEnd[MavImage]
    ground: WatchedFrontEnd[GroundImage]
    slam: frozenset[str]

    def front_ends(self) -> FrontEnds:
        """The front ends, as trackers take them."""
        return FrontEnds(self.mav, self.ground)

    def of(self, robot: Source) -> WatchedFrontEnd[Any]:
        """The front end of one robot."""
        return self.mav if robot == Source.MAV else self.ground

    def tracked(self) -> dict[str, Tracked]:
        """Answers and final trajectories, by robot; to be called at the end."""
        tracked = [self.tracked_by(robot) for robot in (Source.MAV, Source.GROUND)]
        return {one.robot: one for one in tracked}

    def tracked_by(self, robot: Source) -> Tracked:
        """Answers and final trajectory of one robot; to be called at the end."""
        one, name = self.of(robot), robot.name.lower()
        return Tracked(name, one, one.trajectory(), name in self.slam)


def front_ends_for(
    setup: Setup, recording: Pair, truth: Truth | None, rng: np.random.Generator
) -> WatchedFrontEnds:
    """The front ends of a setup, for each robot, with the nominal calibrations of the recording.
    `truth` may be None where the setup has no oracle; `rng` gives the oracles' errors and SLAM's
    samples."""
    way, given = setup.front_ends(), setup.given
    oracles = _oracles(setup, recording, truth, rng)
    mav_rng, ground_rng = rng.spawn(2)
    if oracles and way["mav"] == "oracle":
        mav = oracles.mav
    else:
        mav = named_front_end(recording.mav, way["mav"], setup.config, mav_rng, given.mav)
    if oracles and way["ground"] == "oracle":
        ground = oracles.ground
    else:
        ground = named_front_end(
            recording.ground, way["ground"], setup.config, ground_rng, given.ground
        )
    # Thread time: waits for a core that another process holds do not count.
    clock = time.thread_time
    watched = WatchedFrontEnd(mav, clock), WatchedFrontEnd(ground, clock)
    return WatchedFrontEnds(*watched, setup.slam_robots())


def named_front_end(
    recording: RobotRecording[Any],
    name: str,
    config: Config,
    rng: np.random.Generator,
    trajectory: Trajectory | None,
) -> FrontEnd[Any]:
    """The front end of one robot by its name in the tables of `airground.slam.front_ends`."""
    needs = Ingredients(recording.calibration, config, rng, trajectory)
    if recording.robot is Source.MAV:
        return make_front_end(MAV, name, needs)
    return make_front_end(GROUND, name, needs)


def truth_for(setup: Setup, recording: Path) -> Truth | None:
    """The truth of a recording; None where the setup has no oracle.

    Raises:
        AirgroundError: The truth is missing or damaged.
    """
    if not setup.needs_truth():
        return None
    from sim.recording.truth import Truth

    return Truth.open(recording)


def _oracles(
    setup: Setup, recording: Pair, truth: Truth | None, rng: np.random.Generator
) -> FrontEnds | None:
    """Oracles of both robots; None where the setup has none."""
    if not setup.needs_truth():
        rng.spawn(2)  # as oracles do, so that later draws are the same
        return None
    # Imports Open3D and MuJoCo: 200 MiB that tracking processes do not need.
    from evaluation.table.oracle import oracle_front_ends

    assert truth is not None
    assert isinstance(recording, Recording)
    return oracle_front_ends(recording, truth, setup.noise, rng)
