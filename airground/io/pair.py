"""Two robots' recordings from anywhere, as one stream of messages."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from operator import itemgetter

from airground.core.cloud import Source
from airground.core.messages import Stamped
from airground.errors import RecordingError
from airground.io.robot_recording import RobotRecording


@dataclass(frozen=True, eq=False)
class Pair:
    """What a MAV and a ground robot sensed; both are stamped by the same clock.

    Attributes:
        mav, ground: Their recordings.

    Raises:
        RecordingError: The ground robot begins when the MAV has ended: there is no map to
            locate it in.
    """

    mav: RobotRecording
    ground: RobotRecording

    def __post_init__(self) -> None:
        assert (self.mav.robot, self.ground.robot) == (Source.MAV, Source.GROUND)
        late_ns = int(self.ground.camera_stamps[0] - self.mav.camera_stamps[-1])
        if late_ns > 0:
            raise RecordingError(
                f"{self.ground.path}: begins {late_ns / 1e9:.1f} s after {self.mav.path} ended; "
                "both must be stamped by the same clock, and the ground robot must come first"
            )

    def of(self, robot: Source) -> RobotRecording:
        """One of them."""
        return self.mav if robot == Source.MAV else self.ground

    def messages(self) -> Iterator[Stamped]:
        """Every message of both in order of time; samples come before the next image.

        Raises:
            RecordingError: An image cannot be read or does not fit the calibration.
        """
        streams = (self.ground.bundles(), self.mav.bundles())
        for _, bundle in heapq.merge(*streams, key=itemgetter(0)):
            yield from bundle
