"""Who says where the cameras are, as a setup wants it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.io.recording import Recording
from airground.slam.front_ends import GROUND, MAV, Ingredients, make_front_end
from airground.tracking import FrontEnds
from evaluation.protocol.setups import Setup
from evaluation.runs.watched_front_end import WatchedFrontEnd
from evaluation.truth.oracle import oracle_front_ends
from evaluation.truth.tracking_quality import Tracked
from sim.truth import Truth


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
    setup: Setup, recording: Recording, truth: Truth, rng: np.random.Generator
) -> WatchedFrontEnds:
    """The front ends of a setup: SLAM, an oracle, or a file, for each robot.

    Args:
        setup: Says which.
        recording: Its calibrations and stamps are used, as they are told.
        truth: For the oracles only.
        rng: Draws the oracles' errors and SLAM's samples.
    """
    oracles = oracle_front_ends(recording, truth, setup.noise, rng)
    mav, ground = oracles.mav, oracles.ground
    slam, (mav_rng, ground_rng) = setup.slam_robots(), rng.spawn(2)
    if "mav" in slam:
        mav = make_front_end(MAV, "slam", Ingredients(recording.mav, setup.config, mav_rng))
    if "ground" in slam:
        ground = make_front_end(
            GROUND, "slam", Ingredients(recording.ground, setup.config, ground_rng)
        )
    given = setup.given
    if given.mav is not None:
        brought = Ingredients(recording.mav, setup.config, mav_rng, given.mav)
        mav = make_front_end(MAV, "file", brought)
    if given.ground is not None:
        brought = Ingredients(recording.ground, setup.config, ground_rng, given.ground)
        ground = make_front_end(GROUND, "file", brought)
    # They track in one thread, which waits where another process has more right to the core.
    clock = time.thread_time
    return WatchedFrontEnds(WatchedFrontEnd(mav, clock), WatchedFrontEnd(ground, clock), slam)
