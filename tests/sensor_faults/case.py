"""One robot tracked through faults of its sensors, held against the truth."""

from __future__ import annotations

import traceback
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airground.config import Config
from airground.core.cloud import Source
from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.io.recording import Recording
from airground.io.robot_recording import RobotRecording
from airground.slam.front_end import TrackedPose, Tracking
from airground.slam.front_ends import GROUND, MAV, Ingredients, make_front_end
from sim.recording.recorder import Flight, rendered
from sim.recording.truth import Truth
from sim.sensors.faults import Fault, clock_of, faulty_imu
from sim.sensors.faulty_frames import FaultyFrames
from sim.sensors.robot_clock import RobotClock

AFTER_S = 5.0
"""Time after the last fault in which the robot can find itself again [s]."""
STEADY = RobotClock()
SILENT_M, SILENT_SIGMAS = 0.05, 3.0
"""A pose whose error grew by more than both, by its own covariance, is silently wrong."""


@dataclass(frozen=True)
class Outcome:
    """What became of the poses of one robot.

    Attributes:
        images, lost: Images from the first fault on, and those of them without a pose.
        again_s: Time from the last fault's end to the first pose after it [s]; NaN without one.
        step_m, step_sigmas: Largest change of the error from pose to pose [m], and the largest by
            the stated deviation of the later one.
        off_m, off_deg: Largest growth of the error of a pose that was given out [m, deg].
        silent_s: Longest time for which poses were silently wrong [s].
        blind: Images that show nothing new and have a pose all the same.
        error: Last line of a traceback; empty without one.
    """

    images: int
    lost: int
    again_s: float
    step_m: float
    step_sigmas: float
    off_m: float
    off_deg: float
    silent_s: float
    blind: int
    error: str = ""


def stored(recording: Recording, faults: Sequence[Fault]) -> RobotRecording[Any]:
    """The faulty robot's part of a recording that was made without faults."""
    part: Any = recording.of(Source[faults[0].robot.upper()])
    frames = FaultyFrames.of(part.camera_stamps, faults)

    def read(index: int) -> MavImage | GroundImage:
        image, stamp = part.read_image(int(frames.taken[index])), int(frames.stamps_ns[index])
        if isinstance(image, MavImage):
            return MavImage(stamp, frames.image(index, image.image))
        depth = image.depth if frames.depth[index] else np.full_like(image.depth, np.nan)
        return GroundImage(stamp, frames.image(index, image.colour), depth)

    imu = faulty_imu(part.imu, faults)
    stamps = frames.stamps_ns
    return replace(part, camera_stamps=stamps, imu=imu, magnetic=None, read_image=read)


def unseen(camera_stamps: NDArray[np.int64], faults: Sequence[Fault]) -> frozenset[int]:
    """Stamps [ns] of the images that show nothing new: black ones, and those equal to the one
    before.

    Args:
        camera_stamps: (N,) stamps of the images without faults [ns].
        faults: Faults of that robot, placed.
    """
    frames = FaultyFrames.of(camera_stamps, faults)
    repeats = np.diff(frames.taken, prepend=-1) == 0
    return frozenset(frames.stamps_ns[repeats | (frames.gain == 0)].tolist())


@contextmanager
def drawn(flight: Flight) -> Iterator[tuple[RobotRecording[Any], Truth]]:
    """The ground robot's part of a flight, and the truth, rendered as it is read."""
    with rendered(flight, 1) as recording:
        yield recording.ground, Truth.open(recording.path)


def tracked(part: RobotRecording[Any], until_ns: int, seed: int = 0) -> list[TrackedPose]:
    """The pose of every image up to a time."""
    table: Any = MAV if part.robot == Source.MAV else GROUND
    given = Ingredients(part.calibration, Config(), np.random.default_rng(seed))
    front_end = make_front_end(table, "slam", given)
    poses = []
    for stamped in part.messages():
        if isinstance(stamped.message, ImuSamples):
            front_end.add_imu(stamped.message)
        elif isinstance(stamped.message, MavImage | GroundImage):
            if stamped.message.stamp_ns > until_ns:
                break
            poses.append(front_end.track(stamped.message))
    front_end.finish()
    return poses


def outcome(
    part: RobotRecording[Any],
    truth: Truth,
    faults: Sequence[Fault],
    dark: Collection[int],
    after_s: float = AFTER_S,
    clock: RobotClock = STEADY,
) -> Outcome:
    """Track a robot through its faults, and for `after_s` on, and hold its poses against the truth;
    `dark` are stamps of images that show nothing new (`unseen`) [ns], and `clock` is that of the
    stamps, where the truth does not know of its steps."""
    ahead_ns = sum(round(fault.strength * 1e9) for fault in faults if fault.kind == "clock")
    start_ns = min(fault.start_ns for fault in faults)
    end_ns = max(fault.end_ns for fault in faults)
    try:
        poses = tracked(part, end_ns + ahead_ns + round(after_s * 1e9))
    except Exception as error:  # what it is, is the result
        place = traceback.extract_tb(error.__traceback__)[-1]
        said = f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}"
        return Outcome(0, 0, *6 * [np.nan], 0, said)
    return judged(poses, truth, faults[0].robot, start_ns, end_ns, ahead_ns, dark, clock)


def outcome_in(recording: Recording, faults: Sequence[Fault], after_s: float = AFTER_S) -> Outcome:
    """The outcome of faults of one robot in a recording that was made without faults."""
    camera_stamps = recording.of(Source[faults[0].robot.upper()]).camera_stamps
    part, truth = stored(recording, faults), Truth.open(recording.path)
    return outcome(part, truth, faults, unseen(camera_stamps, faults), after_s, clock_of(faults))


def judged(
    poses: Sequence[TrackedPose],
    truth: Truth,
    robot: Any,
    start_ns: int,
    end_ns: int,
    ahead_ns: int,
    dark: Collection[int] = (),
    clock: RobotClock = STEADY,
) -> Outcome:
    """Hold poses against the truth, from the start to the end of the faults and on.

    A clock that stepped is `ahead_ns` from the start on; 0 for other faults."""

    def taken(pose: TrackedPose) -> int:
        return pose.stamp_ns - (ahead_ns if pose.stamp_ns >= start_ns + ahead_ns else 0)

    def true(pose: TrackedPose) -> SE3:
        return truth.T_world_camera(robot, clock.time_ns(pose.stamp_ns))

    known = [pose for pose in poses if pose.tracking is Tracking.TRACKED]
    before = [pose for pose in known if taken(pose) < start_ns]
    after = [pose for pose in poses if taken(pose) >= start_ns]
    assert before, "the fault began before the robot had a map"
    assert before[-1].T_map_camera is not None
    T_map_world = before[-1].T_map_camera @ true(before[-1]).inverse()
    last = np.zeros(3)
    step, sigmas, off, off_rad, silent_s, silent_since = 0.0, 0.0, 0.0, 0.0, 0.0, None
    for pose in after:
        if pose.T_map_camera is None:
            silent_since = None
            continue
        T_map_true = T_map_world @ true(pose)
        error = pose.T_map_camera.translation - T_map_true.translation
        off_rad = max(off_rad, (T_map_true.inverse() @ pose.T_map_camera).angle())
        sigma = np.inf if pose.covariance is None else np.sqrt(np.trace(pose.covariance[:3, :3]))
        change = float(np.linalg.norm(error - last))
        step, sigmas = max(step, change), max(sigmas, change / sigma)
        size, last = float(np.linalg.norm(error)), error
        off = max(off, size)
        if size > max(SILENT_M, SILENT_SIGMAS * sigma):
            silent_since = pose.stamp_ns if silent_since is None else silent_since
            silent_s = max(silent_s, (pose.stamp_ns - silent_since) * 1e-9 + 1 / 30)
        else:
            silent_since = None
    given = [pose for pose in after if pose.T_map_camera is not None]
    again = [taken(pose) for pose in given if taken(pose) >= end_ns]
    again_s = (again[0] - end_ns) * 1e-9 if again else np.nan
    lost = len(after) - len(given)
    blind = sum(pose.stamp_ns in dark for pose in given)
    off_deg = float(np.degrees(off_rad))
    return Outcome(len(after), lost, again_s, step, sigmas, off, off_deg, silent_s, blind)
