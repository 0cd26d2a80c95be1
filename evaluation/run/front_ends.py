"""Who says where the cameras are, as a setup wants it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.io.recording import Recording
from airground.slam.front_ends import GROUND, MAV, Ingredients, make_front_end
from airground.tracking import FrontEnds
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import Tracked, WatchedFrontEnd

if TYPE_CHECKING:
    from sim.recording.truth import Truth


@dataclass(frozen=True, eq=False)
class WatchedFrontEnds:
    """The front ends of both robots.

    Attributes:
        mav, ground: They.
        slam: Those robots ("mav", "ground") whose front end is SLAM.
    """

    mav: WatchedFrontEnd[MavImage]
    ground: WatchedFrontEnd[GroundImage]
    slam: frozenset[str]

    def front_ends(self) -> FrontEnds:
        """As the pipeline takes them."""
        return FrontEnds(self.mav, self.ground)

    def of(self, robot: Source) -> WatchedFrontEnd[Any]:
        """One of them."""
        return self.mav if robot == Source.MAV else self.ground

    def tracked(self) -> dict[str, Tracked]:
        """What they said, by robot; to be asked at the end."""
        tracked = [self.tracked_by(robot) for robot in (Source.MAV, Source.GROUND)]
        return {one.robot: one for one in tracked}

    def tracked_by(self, robot: Source) -> Tracked:
        """What one of them said; to be asked at the end."""
        one, name = self.of(robot), robot.name.lower()
        return Tracked(name, one, one.trajectory(), name in self.slam)


def front_ends_for(
    setup: Setup, recording: Recording, truth: Truth | None, rng: np.random.Generator
) -> WatchedFrontEnds:
    """The front ends of a setup: SLAM, an oracle, or a file, for each robot.

    Args:
        setup: Says which.
        recording: Its calibrations and stamps are used, as they are told.
        truth: For oracles; None where the setup has none.
        rng: Draws the oracles' errors and SLAM's samples.
    """
    way, given = setup.front_ends(), setup.given
    oracles = _oracles(setup, recording, truth, rng)
    mav_rng, ground_rng = rng.spawn(2)
    if oracles and way["mav"] == "oracle":
        mav = oracles.mav
    else:
        needs = Ingredients(recording.mav.calibration, setup.config, mav_rng, given.mav)
        mav = make_front_end(MAV, way["mav"], needs)
    if oracles and way["ground"] == "oracle":
        ground = oracles.ground
    else:
        needs = Ingredients(recording.ground.calibration, setup.config, ground_rng, given.ground)
        ground = make_front_end(GROUND, way["ground"], needs)
    # They track in one thread, which waits where another process has more right to the core.
    clock = time.thread_time
    watched = WatchedFrontEnd(mav, clock), WatchedFrontEnd(ground, clock)
    return WatchedFrontEnds(*watched, setup.slam_robots())


def truth_for(setup: Setup, recording: Path) -> Truth | None:
    """The truth that oracles need; None where the setup has none.

    Raises:
        AirgroundError: It is not there or damaged.
    """
    if not setup.needs_truth():
        return None
    from sim.recording.truth import Truth

    return Truth.open(recording)


def _oracles(
    setup: Setup, recording: Recording, truth: Truth | None, rng: np.random.Generator
) -> FrontEnds | None:
    """Of both robots, where any is needed."""
    if not setup.needs_truth():
        rng.spawn(2)  # as oracles would: whoever draws next draws the same
        return None
    # Open3D and MuJoCo come along: who only tracks does without them and their 200 MiB.
    from evaluation.table.oracle import oracle_front_ends

    assert truth is not None
    return oracle_front_ends(recording, truth, setup.noise, rng)
