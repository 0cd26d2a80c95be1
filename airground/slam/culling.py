"""Removing redundant keyframes.

The rule of ORB-SLAM (Mur-Artal, Montiel and Tardos, T-RO 2015, Sec. VI-E), with one difference:
others need not have seen a keyframe's points, only look at them from about the same side. Each
visit adds points; only so the number of keyframes stays bounded in a bounded area.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from airground.config import KeyframeSlam
from airground.core.arrays import F64, I64, Mask
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam.map_adjustment import MapAdjuster
from airground.slam.reacquisition import BORDER_PX, MAX_TURN_DEG, MAX_ZOOM
from airground.slam.recovery import Recovery
from airground.slam.sparse_map import SparseMap, camera_poses
from airground.slam.tracked_path import TrackedPath

COVERED_SHARE = 0.9
"""Least share of a keyframe's points that must be in view of others for it to be culled."""
COVERED_BY = 5
"""Number of other keyframes that must have such a point in view."""


@dataclass(eq=False)
class KeyframeCuller:
    """Looks at one or two keyframes whenever a new one was made; never culls the first, those of
    the window, or one whose inertial motion adjusting the whole map still needs."""

    map: SparseMap
    adjuster: MapAdjuster
    recovery: Recovery
    path: TrackedPath
    camera: PinholeCamera
    T_rig_camera: SE3
    parameters: KeyframeSlam
    _next: int = field(default=1, init=False)

    def cull(self, inertial: bool) -> None:
        """Judge the keyframe that just left the window and, in turn, one of the older ones."""
        # One keyframe stays beside the window: inertial motion leads from it.
        left = len(self.map.keyframes) - self.parameters.window - 2
        if left >= 1:
            self._judge(left, inertial)
        if left >= 2:
            self._next = self._next if self._next < left else 1
            if not self._judge(self._next, inertial):
                self._next += 1
        self.map.compact()

    def _judge(self, keyframe: int, inertial: bool) -> bool:
        """Take a keyframe out if it may go; returns whether it did."""
        if (inertial and not self.adjuster.can_skip(keyframe)) or not self.covered(keyframe):
            return False
        keyframes = self.map.keyframes
        before, gone, after = keyframes[keyframe - 1 : keyframe + 2]
        sooner = gone.stamp_ns - before.stamp_ns <= after.stamp_ns - gone.stamp_ns
        self.path.rehang(gone, before if sooner else after)
        self.adjuster.skip(keyframe, inertial)
        self.recovery.forget(gone.stamp_ns)
        self.map.cull(keyframe)
        return True

    def covered(self, keyframe: int) -> bool:
        """Whether enough others outside of the window have a keyframe's points in view."""
        one = self.map.keyframes[keyframe]
        ids = one.ids[self.map.mapped(one.ids)]
        if len(ids) == 0:
            return True
        points = self.map.positions[ids]
        outside = self.map.keyframes[: -self.parameters.window - 1]
        rotations, centres = camera_poses(outside, self.T_rig_camera)
        alike = self._alike(rotations, centres, keyframe, points.mean(axis=0))
        alike[keyframe] = False
        views = self._views(rotations[alike], centres[alike], points)
        return bool((views >= COVERED_BY).mean() >= COVERED_SHARE)

    def _alike(self, rotations: F64, centres: F64, keyframe: int, middle: F64) -> Mask:
        """(K,) which cameras see a place from the same side and about as far as a keyframe."""
        cosines = (np.einsum("nij,ij->n", rotations, rotations[keyframe]) - 1.0) / 2.0
        depths = np.einsum("ni,ni->n", middle - centres, rotations[:, :, 2])
        with np.errstate(divide="ignore", invalid="ignore"):
            zoom = np.abs(np.log(depths / depths[keyframe]))
        result: Mask = (cosines > np.cos(np.deg2rad(MAX_TURN_DEG))) & (zoom < np.log(MAX_ZOOM))
        return result

    def _views(self, rotations: F64, centres: F64, points: F64) -> I64:
        """(n,) in how many of the cameras each point lies inside the image."""
        seen = np.einsum("kij,kni->knj", rotations, points - centres[:, None])
        camera = self.camera
        with np.errstate(divide="ignore", invalid="ignore"):
            x = camera.fx * seen[..., 0] / seen[..., 2] + camera.cx
            y = camera.fy * seen[..., 1] / seen[..., 2] + camera.cy
        inside = (seen[..., 2] > 0) & (x >= BORDER_PX) & (y >= BORDER_PX)
        inside &= (x < camera.width - BORDER_PX) & (y < camera.height - BORDER_PX)
        result: I64 = inside.sum(axis=0)
        return result
