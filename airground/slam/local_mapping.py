"""What a new keyframe adds to the map: points, old points seen again, better poses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from airground.config import KeyframeSlam
from airground.core.arrays import F32, F64, I64, U8, Mask
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam.corners import detect_corners
from airground.slam.depth_lookup import inverse_depths_at
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.geometry.pose_estimation import estimate_pose
from airground.slam.geometry.triangulation import triangulate_pairs
from airground.slam.inertial.preintegration import Preintegration
from airground.slam.map_adjustment import MapAdjuster
from airground.slam.reacquisition import find_in_keyframes, keyframes_in_view, visible
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import CANDIDATE, Keyframe, SparseMap

MAX_TRIANGULATION_ERROR_PX = 2.0
MIN_REUSED = 12
"""Fewer old points than this found again could be chance."""
CROWDED = 0.5
"""Corners closer than this share of their spacing when chosen are too many."""
REUSE_SEARCH_PX = 15.0
"""An old point farther than this from where it was expected is another."""


@dataclass(frozen=True, eq=False)
class NewKeyframe:
    """An image that becomes a keyframe.

    Attributes:
        stamp_ns: Stamp of the image [ns].
        image: (height, width) grey image.
        depth: (height, width) depth [m]; None without a depth camera.
        state: Tracked state of the rig.
        motion: Inertial motion since the last keyframe, where known.
        still: Whether the robot is at rest.
    """

    stamp_ns: int
    image: U8
    depth: F32 | None
    state: RigState
    motion: Preintegration | None
    still: bool = False


@dataclass(eq=False)
class LocalMapper:
    """Extends the map by one keyframe at a time.

    Attributes:
        map, tracker: Map and followed corners, changed in place.
        adjuster: Bundle adjustment of the map.
        camera, T_rig_camera: The robot's camera.
        parameters: The robot's section of the configuration.
        max_depth_m: Largest depth that starts a point [m].
        found_old: Whether the newest keyframe found points again of keyframes older than the
            window.
    """

    map: SparseMap
    tracker: FeatureTracker
    adjuster: MapAdjuster
    camera: PinholeCamera
    T_rig_camera: SE3
    parameters: KeyframeSlam
    max_depth_m: float = np.inf
    found_old: bool = field(default=False, init=False)

    def insert(self, new: NewKeyframe, inertial: bool) -> F64 | None:
        """Add a keyframe; returns the covariance of its pose where it is known.

        Args:
            new: The keyframe, whose image is the tracker's newest.
            inertial: Whether the map is metric and gravity-aligned.
        """
        keyframe = self._append(new)
        index = len(self.map.keyframes) - 1
        if new.motion is not None:
            self.adjuster.motions[index] = new.motion
        self._triangulate(keyframe)
        self.found_old = self._reuse(keyframe, new)
        covariance = self.adjuster.adjust_window(inertial)
        self.tracker.keep(~self._dropped(self.tracker.ids))
        self.tracker.thin(CROWDED * self.parameters.corner_spacing_px)
        self._detect(keyframe, index, new)
        return covariance

    def _append(self, new: NewKeyframe) -> Keyframe:
        pixels = self.tracker.pixels.astype(np.float64)
        keyframe = Keyframe(
            new.stamp_ns,
            new.image,
            new.state,
            self.tracker.ids.copy(),
            pixels,
            self._inverse_depths(new, pixels),
            new.still,
        )
        self.map.keyframes.append(keyframe)
        return keyframe

    def _inverse_depths(self, new: NewKeyframe, pixels: F64) -> F64:
        if new.depth is None:
            return np.full(len(pixels), np.nan)
        return inverse_depths_at(new.depth, pixels, self.max_depth_m)

    def _dropped(self, ids: I64) -> Mask:
        states = self.map.states[ids]
        result: Mask = (states != CANDIDATE) & ~self.map.mapped(ids)
        return result

    def _triangulate(self, keyframe: Keyframe) -> None:
        """Place candidates whose rays from first sight and from here cross well."""
        rows = np.flatnonzero(self.map.states[keyframe.ids] == CANDIDATE)
        if len(rows) == 0:
            return
        ids = keyframe.ids[rows]
        origins = [self.map.keyframes[k] for k in self.map.origins[ids]]
        points = triangulate_pairs(
            self._cameras(origins),
            self.map.first_pixels[ids],
            self._cameras([keyframe] * len(ids)),
            keyframe.pixels[rows],
            self.camera,
        )
        good = points.good & (points.parallax_rad > np.deg2rad(self.parameters.min_parallax_deg))
        good &= points.reprojection_px < MAX_TRIANGULATION_ERROR_PX
        self.map.place(ids[good], points.points[good])

    def _cameras(self, keyframes: list[Keyframe]) -> tuple[F64, F64]:
        """(n, 3, 3) and (n, 3) `T_map_camera` of keyframes."""
        T = self.T_rig_camera
        rotations = np.array([k.state.rotation for k in keyframes])
        positions = np.array([k.state.position for k in keyframes])
        return rotations @ T.rotation, rotations @ T.translation + positions

    def _reuse(self, keyframe: Keyframe, new: NewKeyframe) -> bool:
        """Look for points of old keyframes: this is what closes loops before they open.

        Returns whether there were any.
        """
        old = len(self.map.keyframes) - 1 - self.parameters.window
        if old <= 0 or self.parameters.reused_keyframes == 0:
            return False
        T_map_camera = new.state.pose() @ self.T_rig_camera
        ids = np.setdiff1d(self.map.begun_before(old), self.tracker.ids, assume_unique=True)
        expected, inside = visible(self.map.positions[ids], T_map_camera, self.camera)
        ids, expected = ids[inside], expected[inside]
        chosen = keyframes_in_view(
            self.map,
            range(old),
            T_map_camera,
            self.T_rig_camera,
            ids,
            self.parameters.reused_keyframes,
            MIN_REUSED,
        )
        found, pixels = find_in_keyframes(
            self.map,
            chosen,
            ids,
            new.image,
            expected,
            self.parameters.patch_px,
            levels=1,
            search_px=REUSE_SEARCH_PX,
        )
        return self._take_back(keyframe, new, found, pixels)

    def _take_back(self, keyframe: Keyframe, new: NewKeyframe, ids: I64, pixels: F32) -> bool:
        """Follow old points again if they agree with each other on where the camera is."""
        if len(ids) < MIN_REUSED:
            return False
        fit = estimate_pose(
            self.map.positions[ids],
            pixels.astype(np.float64),
            np.full(len(ids), self.parameters.corner_sigma_px),
            self.camera,
            new.state.pose() @ self.T_rig_camera,
            rotation_sigma=0.01,
            position_sigma=0.1,
        )
        good = fit.inliers
        if good.sum() < MIN_REUSED or good.mean() < 0.5:
            return False
        self.tracker.add(ids[good], pixels[good])
        pixels_kept = pixels[good].astype(np.float64)
        keyframe.see(ids[good], pixels_kept, self._inverse_depths(new, pixels_kept))
        return True

    def _detect(self, keyframe: Keyframe, index: int, new: NewKeyframe) -> None:
        """Follow new corners where there are none; with depth they are in the map at once."""
        wanted = self.parameters.corners - len(self.tracker.ids)
        corners = detect_corners(
            new.image,
            self.tracker.pixels,
            wanted,
            self.parameters.corner_spacing_px,
            None if new.depth is None else new.depth <= self.max_depth_m,
        )
        pixels = corners.astype(np.float64)
        ids = self.map.new_points(pixels, index)
        inverse_depths = self._inverse_depths(new, pixels)
        keyframe.see(ids, pixels, inverse_depths)
        self.tracker.add(ids, corners)
        known = np.isfinite(inverse_depths)
        if known.any():
            rays = np.column_stack([pixels[known], np.ones(known.sum())])
            rays = rays @ np.linalg.inv(self.camera.matrix()).T
            points_camera = rays / inverse_depths[known, None]
            T_map_camera = keyframe.state.pose() @ self.T_rig_camera
            self.map.place(ids[known], T_map_camera @ points_camera)
