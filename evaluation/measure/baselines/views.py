"""Images for baselines by appearance, read from the recording by their stamps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.io.recording import Recording
from evaluation.measure.baselines.interface import View

VIEWS = 3
"""Number of ground views per sighting."""
CANDIDATE_STEP_S = 0.2
APART_M, APART_DEG = 0.25, 10.0
"""Least distance or turn between ground views, so that they show different sides."""
MIN_DEPTH_M = 0.3
SAMPLED_POINTS = 500


def aerial_view(recording: Recording, sighting: Sighting) -> View:
    """The MAV's reference image of the surface, at full resolution."""
    surface = sighting.surface
    image = recording.mav.image_at(surface.reference_stamp_ns)
    return View(image.stamp_ns, recording.mav.calibration.camera, surface.T_mav_camera, image.image)


@dataclass(frozen=True, eq=False)
class GroundViews:
    """Selects the ground robot's images that show best what the MAV sees.
    `poses` are stamp [ns] and T_ground_camera of the tracked images, by the robot's own SLAM."""

    recording: Recording
    poses: Sequence[tuple[int, SE3]]

    def nearest(self, sighting: Sighting, T_ground_mav: SE3) -> tuple[View, ...]:
        """Earlier images with the most similar view of the aerial surface to the MAV's, best first.
        Fewer than `VIEWS` if no others see the surface. An approximate pose of the MAV suffices."""
        every = max(1, len(sighting.surface.cloud_mav) // SAMPLED_POINTS)
        points = T_ground_mav @ sighting.surface.cloud_mav.points[::every]
        mav = (T_ground_mav @ sighting.surface.T_mav_camera).translation
        camera = self.recording.ground.calibration.camera
        rated = [
            (_likeness(points, mav, camera, pose), stamp_ns, pose)
            for stamp_ns, pose in self._candidates(sighting.ground_stamp_ns)
        ]
        chosen: list[tuple[int, SE3]] = []
        for likeness, stamp_ns, pose in sorted(rated, key=lambda r: -r[0]):
            if len(chosen) == VIEWS or likeness <= 0:
                break
            if all(_apart(pose, other) for _, other in chosen):
                chosen.append((stamp_ns, pose))
        return tuple(self._view(stamp_ns, pose) for stamp_ns, pose in chosen)

    def _candidates(self, until_ns: int) -> list[tuple[int, SE3]]:
        kept: list[tuple[int, SE3]] = []
        for stamp_ns, pose in self.poses:
            if stamp_ns > until_ns:
                break
            if not kept or stamp_ns - kept[-1][0] >= CANDIDATE_STEP_S * 1e9:
                kept.append((stamp_ns, pose))
        return kept

    def _view(self, stamp_ns: int, pose: SE3) -> View:
        image = self.recording.ground.image_at(stamp_ns)
        grey = np.asarray(cv2.cvtColor(image.colour, cv2.COLOR_RGB2GRAY), np.uint8)
        return View(stamp_ns, self.recording.ground.calibration.camera, pose, grey, image.depth)


def _likeness(points: NDArray, mav: NDArray, camera: PinholeCamera, pose: SE3) -> float:
    """Similarity of a ground camera's view of the surface to the MAV's.
    The mean over the points (N, 3) of the cosine between both lines of sight, 0 where the point is
    outside the image; occlusion is not considered."""
    if len(points) == 0:
        return 0.0
    in_camera = pose.inverse() @ points
    x, y = camera.project(in_camera).T
    with np.errstate(invalid="ignore"):
        seen = (x >= 0) & (x < camera.width) & (y >= 0) & (y < camera.height)
    seen &= in_camera[:, 2] > MIN_DEPTH_M
    from_mav, from_ground = points - mav, points - pose.translation
    lengths = np.linalg.norm(from_mav, axis=1) * np.linalg.norm(from_ground, axis=1)
    cosines = (from_mav * from_ground).sum(axis=1) / np.maximum(lengths, 1e-9)
    return float(np.where(seen, np.maximum(cosines, 0), 0).mean())


def _apart(pose: SE3, other: SE3) -> bool:
    far = np.linalg.norm(pose.translation - other.translation) > APART_M
    return bool(far) or np.rad2deg((pose.inverse() @ other).angle()) > APART_DEG
