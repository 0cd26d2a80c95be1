"""Both robots' tracking over a recording: frames, and what the front ends answered."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from airground.core.messages import Stamped
from airground.core.trajectory import Trajectory
from airground.core.work_ahead import run_ahead
from airground.io.robot_recording import Pair, RobotRecording
from airground.io.tum import write_tum
from airground.slam.warm_up import warm_up_slam
from airground.tracking import TrackedFrame, Trackers
from evaluation.run.drops import DropList
from evaluation.run.front_ends import front_ends_for
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import FrontEndLog, Tracked

if TYPE_CHECKING:
    from sim.recording.truth import Truth

FRAMES_AHEAD = 30
"""Tracked frames of a robot that may wait for mapping: one second at 30 Hz."""


@dataclass(frozen=True)
class TrackingTask:
    """One pass of tracking.

    Attributes:
        recording: Recordings of both robots.
        truth: Source of the oracles' poses; None where the setup has no oracle.
        setup: Choice of the front ends.
        seed: Seed of the front ends.
        drops: Images that do not reach tracking or mapping; None drops nothing.
    """

    recording: Pair
    truth: Truth | None
    setup: Setup
    seed: int
    drops: DropList | None = None

    def messages(self) -> Iterator[Stamped]:
        """Messages that reach the trackers."""
        return self.recording.messages(self.drops.dropped.by_robot() if self.drops else {})

    def received(self, frames: Iterator[TrackedFrame]) -> Iterator[TrackedFrame]:
        """Tracked frames that reach the mapper, as they reach it."""
        return frames if self.drops is None else self.drops.received(frames)


@dataclass(frozen=True)
class TrackingReport:
    """Outcome of tracking, once all images are tracked.

    Attributes:
        tracked: Answers of the front ends, by robot ("mav", "ground").
        ground: The ground robot's final trajectory; None where it has none.
        processor_s: Processor time of separate processes [s]; 0 in this process.
        peak_memory_mib: Peak memory of separate processes, shared memory excluded [MiB].
    """

    tracked: dict[str, Tracked]
    ground: Trajectory | None
    processor_s: float = 0.0
    peak_memory_mib: float = 0.0


class Tracking(Protocol):
    """Tracking of both robots. It needs no answer of mapping, so it may run ahead."""

    def wait_until_ready(self) -> None:
        """Return when everything is compiled."""

    def frames(self) -> Iterator[TrackedFrame]:
        """Tracked frames that reach the mapper, in order of time."""

    def report(self) -> TrackingReport:
        """The outcome; called after the last frame."""


class TrackingHere:
    """Tracking in this process.

    Args:
        task: Recording, front ends, seed and drops.
        ahead: Number of frames that a thread may track ahead of mapping. With 0, each frame is
            tracked on request, so that no stage is timed beside other work.
    """

    def __init__(self, task: TrackingTask, ahead: int = 2 * FRAMES_AHEAD) -> None:
        self._task, self._ahead = task, ahead
        rng = front_end_rng(task.seed)
        self._watched = front_ends_for(task.setup, task.recording, task.truth, rng)
        mav, ground = task.recording.mav, task.recording.ground
        self._trackers = Trackers(mav.calibration, ground.calibration, self._watched.front_ends())

    def wait_until_ready(self) -> None:
        """As `Tracking.wait_until_ready`."""
        warm_up_slam(np.random.default_rng(0))

    def frames(self) -> Iterator[TrackedFrame]:
        """As `Tracking.frames`."""
        frames = self._trackers.frames(self._task.messages())
        return self._task.received(run_ahead(frames, self._ahead) if self._ahead else frames)

    def report(self) -> TrackingReport:
        """As `Tracking.report`."""
        ground = self._trackers.finish()
        return TrackingReport(self._watched.tracked(), ground)


def front_end_rng(seed: int) -> np.random.Generator:
    """Source of the front ends' random numbers, in a run and in the protocol."""
    return np.random.default_rng([seed, 0])


def localizer_rng(seed: int, flight: int, sequence: int = 0) -> np.random.Generator:
    """Source of the particles' random numbers.
    `sequence` is 0 for the pipeline's own localization, and from 1 on for sequences that repeat the
    pipeline's sightings from a later start."""
    return np.random.default_rng([seed, flight, 1, sequence])


def live_path(log: FrontEndLog) -> Trajectory | None:
    """Poses as first given, camera in map; None without any."""
    poses = log.live_poses()
    if not poses:
        return None
    return Trajectory.from_poses([stamp for stamp, _ in poses], [pose for _, pose in poses])


def write_paths(
    folder: Path, name: str, recording: RobotRecording, log: FrontEndLog, final: Trajectory | None
) -> None:
    """Write `NAME.tum` (final poses) and `NAME_live.tum` (poses as first given), where any.
    Poses are those of `recording.pose_frame`, the frame whose truth the publisher states, at the
    publisher's stamps, so that `evo_ape tum` compares the files as they are."""
    T_camera_pose = recording.T_pose_camera.inverse()
    for file, path in ((name, final), (f"{name}_live", live_path(log))):
        if path is not None:
            poses = [path[index] @ T_camera_pose for index in range(len(path))]
            stamps_ns = recording.published_stamps(path.stamps_ns)
            written = Trajectory.from_poses(stamps_ns.tolist(), poses)
            write_tum(folder / f"{file}.tum", written)
