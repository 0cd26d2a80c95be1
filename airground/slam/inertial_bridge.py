"""Mapping on from where inertia has led, after a moment in which nothing was seen."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from airground.config import KeyframeSlam
from airground.slam.corners import detect_corners
from airground.slam.frame import Frame
from airground.slam.motion_model import MotionModel
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import SparseMap

MAX_BRIDGE_NS = 3_000_000_000
"""Longest time without a pose that inertia bridges [ns]: it drifts by 3 cm in 2 s, by 7 in 3.4."""
UNKNOWN_IMAGES = 4
"""So many images in a row must show what is not found in the map: blur can hide it in one."""
MIN_CORNERS = 40
"""Least number of corners with depth by which such an image extends the map."""
NOTHING = np.empty((0, 2), np.float32)


@dataclass(eq=False)
class InertialBridge:
    """Notices that a robot which was blind for a moment looks at what its map does not have.

    Only with depth: its corners are in the map at once, and their scale does not drift.
    """

    map: SparseMap
    motion: MotionModel
    parameters: KeyframeSlam
    max_depth_m: float
    _unknown: int = field(default=0, init=False)
    _seen_ns: int = field(default=0, init=False)

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
        return self.motion.preintegrate(last_ns, frame.stamp_ns, state) is not None
