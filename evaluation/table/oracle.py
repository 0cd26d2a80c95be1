"""Front ends with access to the truth: poses with a stated noise and drift, zero included.

They enter the pipeline where SLAM does, which separates the errors of the back end from those
of tracking. Every result states its front end.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from evo.core.geometry import umeyama_alignment
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io.recording import Recording
from airground.slam.front_end import TrackedPose, Tracking
from airground.tracking import FrontEnds
from evaluation.setup.setups import PoseNoise
from sim.recording.truth import Truth

MAV_WANDER_S = 4.0
"""The MAV flies loops and does not drift (Sec. VIII-A): its error wanders this slowly [s]."""

GROUND_SMOOTHING_S = 1.0
"""SLAM drifts smoothly: the ground robot's random walk is smoothed over this time [s]."""


class Oracle:
    """The true poses of one camera, in a map frame of its own, with stated errors.

    The map starts where the first image was taken: z up, turned as the camera's x axis is.

    Args:
        T_world_camera: True pose at a stamp [ns].
        stamps_ns: (N,) stamps of all images that will be asked for.
        drift: (N, 3) position error at each of them, in the map's axes [m].
        turn: (N, 3) orientation error at each of them, axis times angle in the map's axes [rad].
        noise: White noise to add.
        rng: Draws the white noise.
    """

    def __init__(
        self,
        T_world_camera: Callable[[int], SE3],
        stamps_ns: NDArray[np.int64],
        drift: NDArray[np.float64],
        turn: NDArray[np.float64],
        noise: PoseNoise,
        rng: np.random.Generator,
    ) -> None:
        self._T_world_camera = T_world_camera
        self._errors = {
            int(stamp): SE3.from_rotation_vector(turned, shifted)
            for stamp, turned, shifted in zip(stamps_ns, turn, drift, strict=True)
        }
        self._noise = noise
        self._rng = rng
        start = T_world_camera(int(stamps_ns[0]))
        right = start.rotation[:, 0]
        heading = float(np.arctan2(right[1], right[0]))
        self._T_map_world = SE3.from_heading(heading, start.translation).inverse()
        self._tracked: list[tuple[int, SE3]] = []

    def add_imu(self, samples: ImuSamples) -> None:
        """An oracle needs no inertial measurements."""

    def track(self, image: MavImage | GroundImage) -> TrackedPose:
        """The true pose of this image plus the stated errors."""
        T = self._T_map_world @ self._T_world_camera(image.stamp_ns)
        slow = self._errors[image.stamp_ns]
        shift = slow.translation + self._rng.normal(0, self._noise.white_m, 3)
        turn = SE3.from_rotation_vector(self._rng.normal(0, np.deg2rad(self._noise.white_deg), 3))
        T = SE3(slow.rotation @ T.rotation, T.translation + shift) @ turn
        self._tracked.append((image.stamp_ns, T))
        return TrackedPose(image.stamp_ns, Tracking.TRACKED, T)

    def finish(self) -> None:
        """An oracle puts nothing off."""

    def trajectory(self) -> Trajectory | None:
        """The poses as returned."""
        if not self._tracked:
            return None
        stamps, poses = zip(*self._tracked, strict=True)
        return Trajectory.from_poses(list(stamps), list(poses))


def oracle_front_ends(
    recording: Recording, truth: Truth, noise: PoseNoise, rng: np.random.Generator
) -> FrontEnds:
    """Oracles for both robots of a recording."""
    mav_rng, ground_rng = rng.spawn(2)
    mav_stamps, ground_stamps = recording.mav.camera_stamps, recording.ground.camera_stamps
    mav_path = np.array([truth.T_world_mav_camera(int(t)).translation for t in mav_stamps])
    ground_path = np.array([truth.T_world_ground_camera(int(t)).translation for t in ground_stamps])
    mav_drift = _scaled(_wander(mav_stamps, mav_rng), mav_path, noise.drift_mav_m)
    ground_drift = _scaled(
        _random_walk(ground_stamps, ground_path, ground_rng), ground_path, noise.drift_ground_m
    )
    # From generators of their own: positions do not depend on them.
    mav_turn = _turn(_wander(mav_stamps, mav_rng.spawn(1)[0]), noise.drift_mav_deg)
    ground_turn = _turn(
        _random_walk(ground_stamps, ground_path, ground_rng.spawn(1)[0]), noise.drift_ground_deg
    )
    return FrontEnds(
        Oracle(truth.T_world_mav_camera, mav_stamps, mav_drift, mav_turn, noise, mav_rng),
        Oracle(
            truth.T_world_ground_camera, ground_stamps, ground_drift, ground_turn, noise, ground_rng
        ),
    )


def _wander(stamps_ns: NDArray[np.int64], rng: np.random.Generator) -> NDArray[np.float64]:
    """(N, 3) smooth bounded error, of any size."""
    rate = 1e9 / float(np.median(np.diff(stamps_ns)))
    return gaussian_filter1d(rng.normal(size=(len(stamps_ns), 3)), MAV_WANDER_S * rate / 2, axis=0)


def _random_walk(
    stamps_ns: NDArray[np.int64], path: NDArray, rng: np.random.Generator
) -> NDArray[np.float64]:
    """(N, 3) error that grows with the square root of the way driven, of any size."""
    rate = 1e9 / float(np.median(np.diff(stamps_ns)))
    steps = np.linalg.norm(np.diff(path, axis=0, prepend=path[:1]), axis=1)
    walk = np.cumsum(rng.normal(size=path.shape) * np.sqrt(steps)[:, None], axis=0)
    return gaussian_filter1d(walk, GROUND_SMOOTHING_S * rate / 2, axis=0, mode="nearest")


def _scaled(error: NDArray, path: NDArray, rms_m: float) -> NDArray[np.float64]:
    """`error`, scaled so that the drifted path is off by `rms_m` after SE3 alignment.
    The first pose stays exact, as in every SLAM: its map starts there."""
    if rms_m == 0.0:
        return np.zeros_like(path)
    error = error - error[0]
    # Small, so that alignment is linear in the error.
    error = error * (1e-3 / np.sqrt((error**2).sum(axis=1).mean()))
    rotation, translation, _ = umeyama_alignment((path + error).T, path.T, with_scale=False)
    residual = (path + error) @ rotation.T + translation - path
    return error * (rms_m / np.sqrt((residual**2).sum(axis=1).mean()))


def _turn(error: NDArray, rms_deg: float) -> NDArray[np.float64]:
    """`error` as rotation vectors [rad], scaled to this RMS angle; the first pose stays exact."""
    if rms_deg == 0.0:
        return np.zeros_like(error)
    error = error - error[0]
    return error * (np.deg2rad(rms_deg) / np.sqrt((error**2).sum(axis=1).mean()))
