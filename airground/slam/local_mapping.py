"""What a new keyframe adds to the map: points, old points seen again, better poses."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from airground.config import KeyframeSlam
from airground.core.arrays import F32, F64, I64
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam.corners import detect_corners
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.frame import Frame
from airground.slam.geometry.pose_estimation import estimate_pose
from airground.slam.geometry.triangulation import triangulate_pairs
from airground.slam.inertial.preintegration import Preintegration
from airground.slam.map_adjustment import MapAdjuster
from airground.slam.reacquisition import find_in_keyframes, keyframes_in_view, visible
from airground.slam.rig_state import RigState
from airground.slam.rolling_shutter import GLOBAL, Shutter
from airground.slam.sparse_map import CANDIDATE, DROPPED, Keyframe, SparseMap, camera_poses

MAX_TRIANGULATION_ERROR_PX = 2.0
MIN_REUSED = 12
"""Fewer old points than this found again could be chance."""
CROWDED = 0.5
"""Corners closer than this share of their spacing when chosen are too many."""
REUSE_SEARCH_PX = 15.0
"""An old point farther than this from where it was expected is another."""


@dataclass(eq=False)
class LocalMapper:
    """Extends the map by one keyframe at a time.

    Attributes:
        max_depth_m: Largest depth that starts a point [m].
        found_old: Whether the newest keyframe found points of keyframes older than the window.
    """

    map: SparseMap
    tracker: FeatureTracker
    adjuster: MapAdjuster
    camera: PinholeCamera
    T_rig_camera: SE3
    parameters: KeyframeSlam
    max_depth_m: float = np.inf
    found_old: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        self.map.holders.append(self.tracker)

    def insert(
        self,
        frame: Frame,
        state: RigState,
        motion: Preintegration | None,
        inertial: bool,
        still: bool = False,
    ) -> F64 | None:
        """Add a keyframe; returns the covariance of its pose where it is known.

        Args:
            frame: The tracker's newest image.
            state: Tracked state of the rig at that image.
            motion: Inertial motion since the last keyframe; None where it is not known.
            inertial: Whether the map is metric and gravity-aligned.
        """
        ids, pixels = self.tracker.ids.copy(), self.tracker.pixels.astype(np.float64)
        depths = frame.shutter.inverse_depths_at(frame.depth, pixels, self.max_depth_m)
        keyframe = Keyframe(
            frame.stamp_ns,
            frame.image,
            state,
            ids,
            frame.shutter.straight(pixels),
            depths,
            still,
            shutter=frame.shutter,
        )
        self.map.keyframes.append(keyframe)
        index = len(self.map.keyframes) - 1
        if motion is not None:
            self.adjuster.motions[index] = motion
        self._triangulate(keyframe)
        self.found_old = self._reuse(keyframe, frame.depth)
        covariance = self.adjuster.adjust_window(inertial)
        self.tracker.keep(self.map.states[self.tracker.ids] != DROPPED)
        self.tracker.thin(CROWDED * self.parameters.corner_spacing_px)
        self._detect(keyframe, index, frame.depth)
        return covariance

    def straighten_first(self, shutter: Shutter) -> None:
        """Straighten the map's only keyframe by the turn to the next image: none led to it."""
        keyframe = self.map.keyframes[0]
        if len(self.map.keyframes) > 1 or shutter is GLOBAL or keyframe.shutter is not GLOBAL:
            return
        keyframe.inverse_depths = keyframe.inverse_depths * shutter.lengthened(keyframe.pixels)
        keyframe.pixels, keyframe.shutter = shutter.straight(keyframe.pixels), shutter
        self.map.first_pixels[keyframe.ids] = keyframe.pixels
        self._place_by_depth(keyframe, keyframe.ids, keyframe.pixels, keyframe.inverse_depths)

    def _place_by_depth(
        self, keyframe: Keyframe, ids: I64, pixels: F64, inverse_depths: F64
    ) -> None:
        """Put points into the map where a keyframe sees them, if it measures their depth."""
        known = np.isfinite(inverse_depths)
        if known.any():
            rays = np.column_stack([pixels[known], np.ones(known.sum())])
            rays = rays @ np.linalg.inv(self.camera.matrix()).T
            points_camera = rays / inverse_depths[known, None]
            T_map_camera = keyframe.state.pose() @ self.T_rig_camera
            self.map.place(ids[known], T_map_camera @ points_camera)

    def _triangulate(self, keyframe: Keyframe) -> None:
        """Place candidates whose rays from first sight and from here cross well."""
        rows = np.flatnonzero(self.map.states[keyframe.ids] == CANDIDATE)
        if len(rows) == 0:
            return
        ids = keyframe.ids[rows]
        origins = [self.map.keyframes[k] for k in self.map.origins[ids]]
        points = triangulate_pairs(
            camera_poses(origins, self.T_rig_camera),
            self.map.first_pixels[ids],
            camera_poses([keyframe] * len(ids), self.T_rig_camera),
            keyframe.pixels[rows],
            self.camera,
        )
        good = points.good & (points.parallax_rad > np.deg2rad(self.parameters.min_parallax_deg))
        good &= points.reprojection_px < MAX_TRIANGULATION_ERROR_PX
        self.map.place(ids[good], points.points[good])

    def _reuse(self, keyframe: Keyframe, depth: F32 | None) -> bool:
        """Look for points of old keyframes, which closes loops before they open.
        Returns whether there were any."""
        old = len(self.map.keyframes) - 1 - self.parameters.window
        if old <= 0 or self.parameters.reused_keyframes == 0:
            return False
        T_map_camera = keyframe.state.pose() @ self.T_rig_camera
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
            keyframe.image,
            keyframe.shutter.in_image(expected),
            self.parameters.patch_px,
            levels=1,
            search_px=REUSE_SEARCH_PX,
        )
        return self._take_back(keyframe, depth, found, pixels)

    def _take_back(self, keyframe: Keyframe, depth: F32 | None, ids: I64, pixels: F32) -> bool:
        """Follow old points again if they agree with each other on where the camera is."""
        if len(ids) < MIN_REUSED:
            return False
        straight = keyframe.shutter.straight(pixels)
        fit = estimate_pose(
            self.map.positions[ids],
            straight,
            np.full(len(ids), self.parameters.corner_sigma_px),
            self.camera,
            keyframe.state.pose() @ self.T_rig_camera,
            rotation_sigma=0.01,
            position_sigma=0.1,
        )
        good = fit.inliers
        if good.sum() < MIN_REUSED or good.mean() < 0.5:
            return False
        self.tracker.add(ids[good], pixels[good])
        seen_px = pixels[good].astype(np.float64)
        depths = keyframe.shutter.inverse_depths_at(depth, seen_px, self.max_depth_m)
        keyframe.see(ids[good], straight[good], depths)
        return True

    def _detect(self, keyframe: Keyframe, index: int, depth: F32 | None) -> None:
        """Follow new corners where there are none; with depth they are in the map at once."""
        wanted = self.parameters.corners - len(self.tracker.ids)
        corners = detect_corners(
            keyframe.image,
            self.tracker.pixels,
            wanted,
            self.parameters.corner_spacing_px,
            None if depth is None else depth <= self.max_depth_m,
        )
        pixels = keyframe.shutter.straight(corners)
        ids = self.map.new_points(pixels, index)
        seen_px = corners.astype(np.float64)
        inverse_depths = keyframe.shutter.inverse_depths_at(depth, seen_px, self.max_depth_m)
        keyframe.see(ids, pixels, inverse_depths)
        self.tracker.add(ids, corners)
        self._place_by_depth(keyframe, ids, pixels, inverse_depths)
