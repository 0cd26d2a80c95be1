"""Answers of front ends, image by image, and their processing times."""

from __future__ import annotations

import os
import tempfile
import time
from array import array
from collections.abc import Callable, Iterable, MutableSequence, Sequence
from dataclasses import dataclass, field
from typing import IO, Generic, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import AirgroundError
from airground.slam.front_end import FrontEnd, ScaleEstimate, TrackedPose, Tracking

RECORDS_A_CHUNK = 1024
_STATES = tuple(Tracking)
_RECORD = np.dtype(
    [
        ("stamp_ns", np.int64),
        ("tracking", np.uint8),
        ("corrected", np.bool_),
        ("rotation", np.float64, (3, 3)),
        ("translation", np.float64, (3,)),
        ("has_covariance", np.bool_),
        ("covariance", np.float64, (6, 6)),
        ("has_scale", np.bool_),
        ("scale_sigma", np.float64),
        ("scale_observable", np.bool_),
        ("has_depth_range", np.bool_),
        ("depth_range", np.float64, (2,)),
    ]
)


class AnswerLog(Sequence[TrackedPose]):
    """Answers in order of time, without their corners; each is made anew when it is asked for.

    An answer takes 420 bytes, or 90 MB in an hour of two robots, and none is needed before the end:
    full chunks go to a temporary file without a name."""

    def __init__(self, answers: Iterable[TrackedPose] = ()) -> None:
        self._newest = np.zeros(RECORDS_A_CHUNK, _RECORD)
        self._file: IO[bytes] | None = None
        self._read: tuple[int, NDArray[np.void]] | None = None
        self._count = 0
        for answer in answers:
            self.append(answer)

    def __getstate__(self) -> NDArray[np.void]:
        chunks = [self._chunk(index) for index in range(self._count // RECORDS_A_CHUNK + 1)]
        return np.concatenate(chunks)[: self._count]

    def __setstate__(self, records: NDArray[np.void]) -> None:
        AnswerLog.__init__(self)
        for start in range(0, len(records), RECORDS_A_CHUNK):
            some = records[start : start + RECORDS_A_CHUNK]
            self._newest[: len(some)] = some
            self._count += len(some)
            self._put_away()

    def append(self, answer: TrackedPose) -> None:
        """Keep an answer; raises AirgroundError if temporary files have no room."""
        record = self._newest[self._count % RECORDS_A_CHUNK]
        record["stamp_ns"] = answer.stamp_ns
        record["tracking"] = _STATES.index(answer.tracking)
        record["corrected"] = answer.corrected
        if answer.T_map_camera is not None:
            record["rotation"] = answer.T_map_camera.rotation
            record["translation"] = answer.T_map_camera.translation
        if answer.covariance is not None:
            record["has_covariance"], record["covariance"] = True, answer.covariance
        if answer.scale is not None:
            record["has_scale"], record["scale_sigma"] = True, answer.scale.sigma
            record["scale_observable"] = answer.scale.observable
        if answer.depth_range is not None:
            record["has_depth_range"], record["depth_range"] = True, answer.depth_range
        self._count += 1
        self._put_away()

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> TrackedPose: ...
    @overload
    def __getitem__(self, index: slice) -> list[TrackedPose]: ...
    def __getitem__(self, index: int | slice) -> TrackedPose | list[TrackedPose]:
        if isinstance(index, slice):
            return [self._answer(at) for at in range(*index.indices(self._count))]
        at = index + self._count if index < 0 else index
        if not 0 <= at < self._count:
            raise IndexError(f"answer {index} of {self._count}")
        return self._answer(at)

    def _put_away(self) -> None:
        """Write the newest chunk if it is full, and begin another one."""
        if self._count % RECORDS_A_CHUNK or not self._count:
            return
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115
            written = self._file.write(self._newest.tobytes())
        except OSError as error:
            raise AirgroundError(_no_room(error.strerror)) from None
        if written != self._newest.nbytes:
            raise AirgroundError(_no_room("No space left on device"))
        self._newest = np.zeros(RECORDS_A_CHUNK, _RECORD)

    def _chunk(self, index: int) -> NDArray[np.void]:
        """A chunk, from memory or from the file; the last one read is kept."""
        if index == self._count // RECORDS_A_CHUNK:
            return self._newest
        if self._read is None or self._read[0] != index:
            assert self._file is not None
            size = self._newest.nbytes
            content = os.pread(self._file.fileno(), size, index * size)
            self._read = index, np.frombuffer(content, _RECORD)
        return self._read[1]

    def _answer(self, at: int) -> TrackedPose:
        record = self._chunk(at // RECORDS_A_CHUNK)[at % RECORDS_A_CHUNK]
        tracking = _STATES[record["tracking"]]
        pose = covariance = scale = depth_range = None
        # Copies: a view would keep its whole chunk alive.
        if tracking is Tracking.TRACKED:
            pose = SE3(record["rotation"].copy(), record["translation"].copy())
        if record["has_covariance"]:
            covariance = record["covariance"].copy()
        if record["has_scale"]:
            sigma, observable = record["scale_sigma"], record["scale_observable"]
            scale = ScaleEstimate(float(sigma), bool(observable))
        if record["has_depth_range"]:
            near, far = record["depth_range"].tolist()
            depth_range = near, far
        return TrackedPose(
            int(record["stamp_ns"]),
            tracking,
            pose,
            covariance,
            scale,
            depth_range,
            bool(record["corrected"]),
        )


def _no_room(reason: str | None) -> str:
    """One line on why answers cannot be kept."""
    return (
        f"{tempfile.gettempdir()}: poses cannot be kept in a temporary file: {reason}; set TMPDIR "
        "to a folder with room"
    )


Image = TypeVar("Image", MavImage, GroundImage)


@dataclass
class FrontEndLog:
    """Answers of a front end.

    Attributes:
        answers: One per image, in order of time, without corners.
        durations_ms: Processing time of each image and the inertial samples before it, with
            mapping, without decoding.
        waiting: What the front end last waited for without a map; empty where it never did.
    """

    answers: AnswerLog = field(default_factory=AnswerLog)
    durations_ms: MutableSequence[float] = field(default_factory=lambda: array("d"))
    waiting: str = ""

    def stamps_ns(self) -> NDArray[np.int64]:
        """(N,) stamp of each image."""
        return np.array([answer.stamp_ns for answer in self.answers], np.int64)

    def live_poses(self) -> list[tuple[int, SE3]]:
        """Stamp and live pose of each tracked image."""
        return [(a.stamp_ns, a.T_map_camera) for a in self.answers if a.T_map_camera is not None]


class WatchedFrontEnd(FrontEndLog, Generic[Image]):
    """Passes everything on to `inner`, and keeps the answers and their times by `clock` [s]."""

    def __init__(
        self, inner: FrontEnd[Image], clock: Callable[[], float] = time.perf_counter
    ) -> None:
        super().__init__()
        self._inner: FrontEnd[Image] = inner
        self._clock = clock
        self._imu_s = 0.0

    def add_imu(self, samples: ImuSamples) -> None:
        started = self._clock()
        self._inner.add_imu(samples)
        self._imu_s += self._clock() - started

    def track(self, image: Image) -> TrackedPose:
        started = self._clock()
        answer = self._inner.track(image)
        self.durations_ms.append(1e3 * (self._clock() - started + self._imu_s))
        self._imu_s = 0.0
        self.answers.append(answer)
        self.waiting = answer.waiting or self.waiting
        return answer

    def finish(self) -> None:
        self._inner.finish()

    def trajectory(self) -> Trajectory | None:
        return self._inner.trajectory()

    def log(self) -> FrontEndLog:
        """The answers, without the front end."""
        return FrontEndLog(self.answers, self.durations_ms, self.waiting)


@dataclass(frozen=True, eq=False)
class Tracked:
    """A front end's result over a recording: answers image by image, and final poses.
    `slam` is whether it was SLAM, so that its times are worth keeping."""

    robot: str
    front_end: FrontEndLog
    final: Trajectory | None
    slam: bool

    def final_poses(self) -> list[tuple[int, SE3]]:
        if self.final is None:
            return []
        return [(int(stamp), self.final[i]) for i, stamp in enumerate(self.final.stamps_ns)]
