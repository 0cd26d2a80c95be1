"""A front end seen from outside: what it said of each image, and how long it took."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.front_end import FrontEnd, TrackedPose, Tracking
from evaluation.runs.answer_log import AnswerLog

Image = TypeVar("Image", MavImage, GroundImage)


@dataclass
class FrontEndLog:
    """What a front end said.

    Attributes:
        answers: One an image, in order of time, without corners.
        durations_ms: Of each image with the inertial samples before it, mapping included,
            decoding not.
    """

    answers: AnswerLog = field(default_factory=AnswerLog)
    durations_ms: list[float] = field(default_factory=list)

    def live_poses(self) -> list[tuple[int, SE3]]:
        """Stamp and pose of each tracked image, as they were said at its time."""
        return [(a.stamp_ns, a.T_map_camera) for a in self.answers if a.T_map_camera is not None]

    def since_tracking(self) -> list[TrackedPose]:
        """The answers from the first tracked image on; none where there is no such image."""
        for first, answer in enumerate(self.answers):
            if answer.tracking is Tracking.TRACKED:
                return self.answers[first:]
        return []


class WatchedFrontEnd(FrontEndLog, Generic[Image]):
    """Passes everything on, and keeps the answers and their times.

    Args:
        inner: Who really tracks.
        clock: Tells the time [s].
    """

    def __init__(
        self, inner: FrontEnd[Image], clock: Callable[[], float] = time.perf_counter
    ) -> None:
        super().__init__()
        self._inner: FrontEnd[Image] = inner
        self._clock = clock
        self._imu_s = 0.0

    def add_imu(self, samples: ImuSamples) -> None:
        """Pass inertial measurements on."""
        started = self._clock()
        self._inner.add_imu(samples)
        self._imu_s += self._clock() - started

    def track(self, image: Image) -> TrackedPose:
        """Pass an image on."""
        started = self._clock()
        answer = self._inner.track(image)
        self.durations_ms.append(1e3 * (self._clock() - started + self._imu_s))
        self._imu_s = 0.0
        self.answers.append(answer)
        return answer

    def finish(self) -> None:
        """Let it finish."""
        self._inner.finish()

    def trajectory(self) -> Trajectory | None:
        """The poses that it believes in now."""
        return self._inner.trajectory()

    def log(self) -> FrontEndLog:
        """What it said, without itself."""
        return FrontEndLog(self.answers, self.durations_ms)
