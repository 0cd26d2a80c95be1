"""Times in which none of a robot's sensors has a sample.

A sensor that fails leaves a gap in its own stream. A gap in all streams at once is that of the
computer that stamps and stores them. If its clock steps ahead, no time is missing, but all later
stamps are too large, and such a gap is all that the stamps show of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from airground.core.arrays import I64
from airground.io.robot_recording import RobotRecording

LEAST_PERIODS = 2.0
"""Silence is longer than this many periods of the slower one of camera and IMU: a single dropped
image leaves two periods between its neighbours."""


@dataclass(frozen=True)
class Silence:
    """Time between two samples of a robot, whichever sensors they are of, with none between.

    Attributes:
        start_ns, end_ns: Stamps of the last sample before and of the first one after [ns].
    """

    start_ns: int
    end_ns: int

    @property
    def duration_s(self) -> float:
        """Time from the sample before to the one after [s]."""
        return (self.end_ns - self.start_ns) / 1e9


def silences(recording: RobotRecording[Any]) -> tuple[Silence, ...]:
    """Times in which camera, IMU and magnetometer are all silent, in order of time, while both
    images and inertial samples are recorded.

    None without an IMU: what a camera alone leaves out may be dropped images.
    """
    if recording.imu is None:
        return ()
    streams = [recording.camera_stamps, recording.imu.stamps_ns]
    if min(len(stamps) for stamps in streams) < 2:
        return ()
    period_ns = max(float(np.median(np.diff(stamps))) for stamps in streams)
    if recording.magnetic is not None:
        streams.append(recording.magnetic.stamps_ns)
    first_ns = max(int(one[0]) for one in streams[:2])
    last_ns = min(int(one[-1]) for one in streams[:2])
    stamps: I64 = np.sort(np.concatenate(streams))
    stamps = stamps[(stamps >= first_ns) & (stamps <= last_ns)]
    before = np.flatnonzero(np.diff(stamps) > LEAST_PERIODS * period_ns)
    return tuple(Silence(int(stamps[k]), int(stamps[k + 1])) for k in before)


def silence_note(recording: RobotRecording[Any]) -> str:
    """One line on the longest silence, how many there are, and what it may mean; empty without
    any."""
    found = silences(recording)
    if not found:
        return ""
    longest = max(found, key=lambda silence: silence.duration_s)
    first_ns = int(recording.camera_stamps[0])
    start_s, end_s = ((t - first_ns) / 1e9 for t in (longest.start_ns, longest.end_ns))
    others = f" (the longest of {len(found)} such times)" if len(found) > 1 else ""
    return (
        f"all sensors are silent from {start_s:.2f} to {end_s:.2f} s after the first image"
        f"{others}; if the clock stepped there, later stamps are ahead by about "
        f"{longest.duration_s:.2f} s, and poses relative to the other robot are off by its motion "
        "in this time"
    )
