"""Poses of an external system, from a trajectory that was read from a TUM file."""

from __future__ import annotations

import numpy as np

from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.trajectory import Trajectory
from airground.slam.front_end import PoseLog, TrackedPose, Tracking


class TrajectoryFile:
    """A front end that looks poses up.

    A stamp between two poses that are at most 1.5 usual steps apart is interpolated; one
    outside, or in a longer gap, takes the nearest pose if that is within half a step, and
    is lost otherwise. The file's own frame is the map: it must be metric with z up, and its
    poses `T_map_camera`.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        self._trajectory = trajectory
        steps = np.diff(trajectory.stamps_ns)
        self._step_ns = float(np.median(steps)) if len(steps) else 0.0
        self._log = PoseLog()

    def add_imu(self, samples: ImuSamples) -> None:
        """The poses are known already."""

    def track(self, image: MavImage | GroundImage) -> TrackedPose:
        """The pose at the image's stamp."""
        stamps, stamp = self._trajectory.stamps_ns, image.stamp_ns
        after = int(np.searchsorted(stamps, stamp))
        before = max(after - 1, 0)
        after = min(after, len(stamps) - 1)
        inside = stamps[before] <= stamp <= stamps[after]
        if inside and stamps[after] - stamps[before] <= 1.5 * self._step_ns:
            return self._log.tracked(stamp, self._trajectory.at(stamp))
        nearest = min((before, after), key=lambda index: abs(int(stamps[index]) - stamp))
        if abs(int(stamps[nearest]) - stamp) <= self._step_ns / 2:
            return self._log.tracked(stamp, self._trajectory[nearest])
        if self._log.trajectory():
            return TrackedPose(stamp, Tracking.LOST, None)
        waiting = (
            f"a pose near the image: the newest image is of {stamp * 1e-9:.3f} s, the poses are of "
            f"{stamps[0] * 1e-9:.3f} to {stamps[-1] * 1e-9:.3f} s"
        )
        return TrackedPose(stamp, Tracking.INITIALIZING, None, waiting=waiting)

    def finish(self) -> None:
        """Nothing was put off."""

    def trajectory(self) -> Trajectory | None:
        """The poses as they were returned."""
        return self._log.trajectory()
