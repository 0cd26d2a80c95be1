"""Mapping on from where inertia has led, after a moment in which nothing was seen."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from airground.config import KeyframeSlam
from airground.core.arrays import F64, I64
from airground.slam.corners import detect_corners
from airground.slam.frame import Frame
from airground.slam.inertial.preintegration import GRAVITY
from airground.slam.motion_model import MotionModel
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import SparseMap

MAX_BRIDGE_NS = 3_000_000_000
"""Longest time without a pose that inertia bridges [ns]: it drifts by 3 cm in 2 s, 7 in 3.2."""
UNKNOWN_IMAGES = 4
"""So many images in a row must show what is not found in the map: blur can hide it in one."""
MIN_CORNERS = 40
"""Least number of corners with depth by which such an image extends the map."""
NOTHING = np.empty((0, 2), np.float32)


@dataclass(eq=False)
class InertialBridge:
    """Notices that a robot which was blind for a moment looks at what its map does not have.

    Only with depth: its corners are in the map at once, and their scale does not drift. What
    inertia led astray is an error of all later poses, until points from before are seen again.
    """

    map: SparseMap
    motion: MotionModel
    parameters: KeyframeSlam
    max_depth_m: float
    _unknown: int = field(default=0, init=False)
    _seen_ns: int = field(default=0, init=False)
    # Time without a pose [s], by the stamp of the last pose before it [ns].
    _bridged: dict[int, float] = field(default_factory=dict, init=False)

    def due(self, frame: Frame, state: RigState, seen_ns: int) -> bool:
        """Whether to map on from the newest image; to be asked for each image without a pose.

        Args:
            frame: The image.
            state: Where inertia has led.
            seen_ns: Stamp of the last image with a pose [ns].
        """
        if frame.depth is None or frame.stamp_ns - seen_ns > MAX_BRIDGE_NS:
            return False
        if seen_ns != self._seen_ns:
            self._unknown, self._seen_ns = 0, seen_ns
        near = frame.depth <= self.max_depth_m
        spacing_px = self.parameters.corner_spacing_px
        x, y = detect_corners(frame.image, NOTHING, 2 * MIN_CORNERS, spacing_px, near).astype(int).T
        self._unknown = self._unknown + 1 if near[y, x].sum() >= MIN_CORNERS else 0
        last_ns = self.map.keyframes[-1].stamp_ns
        if self._unknown < UNKNOWN_IMAGES:
            return False
        self._unknown = 0
        if self.motion.preintegrate(last_ns, frame.stamp_ns, state) is None:
            return False
        self._bridged[seen_ns] = (frame.stamp_ns - seen_ns) * 1e-9
        return True

    def covariance(self, ids: I64, tilt_sigma: float) -> F64:
        """(6, 6) of the newest pose by what inertia led astray: a vertical that is off by an angle
        takes part of gravity for motion.

        Args:
            ids: (n,) points that the newest image shows.
            tilt_sigma: Standard deviation of the map's vertical per axis [rad].
        """
        for before_ns in [stamp for stamp in self._bridged if self._shows_old(ids, stamp)]:
            del self._bridged[before_ns]
        fallen_m = [0.5 * GRAVITY * seconds**2 for seconds in self._bridged.values()]
        total = np.zeros((6, 6))
        total[:2, :2] = np.square(tilt_sigma * np.array(fallen_m)).sum() * np.eye(2)
        return total

    def _shows_old(self, ids: I64, stamp_ns: int) -> bool:
        """Whether points show where the camera is in the part of the map from up to a stamp."""
        first_later = sum(keyframe.stamp_ns <= stamp_ns for keyframe in self.map.keyframes)
        old = self.map.mapped(ids) & (self.map.origins[ids] < first_later)
        return int(old.sum()) >= self.parameters.min_points
