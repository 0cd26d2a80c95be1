"""Getting back into the map after tracking was lost."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from airground.config import KeyframeSlam
from airground.core.arrays import F32, F64, I64, U8
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam.frame import Frame
from airground.slam.geometry.pose_estimation import PoseFit, estimate_pose
from airground.slam.geometry.relocalization import KeyframeIndex
from airground.slam.reacquisition import find_in_keyframes, keyframes_in_view, visible
from airground.slam.rolling_shutter import GLOBAL, Shutter
from airground.slam.sparse_map import Keyframe, SparseMap

MIN_FOUND = 20
"""Least number of agreeing map points for a relocalization."""
MIN_FOUND_TURN_KNOWN = 12
"""Least number of agreeing points where a gyro gives the rotation: fewer agree by chance."""
TURN_SIGMA = 0.02
"""Standard deviation of the gyro's rotation while nothing is seen [rad]."""
LEVELS = 3
KEYFRAMES = 3
MAX_TURN_DEG = 40.0
"""Where no view is more similar, one turned so far still shows some points alike."""
NOTHING = np.empty(0, np.int64)


@dataclass(frozen=True, eq=False)
class Found:
    """The map, found again: points (n,) seen at pixels (n, 2) of the image, and the camera's pose
    by them."""

    ids: I64
    pixels: F64
    fit: PoseFit


@dataclass(eq=False)
class Recovery:
    """Finds the pose of an image in the map without that of the image before."""

    map: SparseMap
    camera: PinholeCamera
    T_rig_camera: SE3
    parameters: KeyframeSlam
    _index: KeyframeIndex = field(default_factory=KeyframeIndex, init=False)

    def __post_init__(self) -> None:
        self.map.holders.append(self._index)

    def add_keyframe(self) -> None:
        """Make the newest keyframe known."""
        keyframe = self.map.keyframes[-1]
        self._index.add(keyframe.stamp_ns, keyframe.image, keyframe.ids, keyframe.in_image())

    def forget(self, stamp_ns: int) -> None:
        """Do not look for the keyframe of that stamp any more."""
        self._index.remove(stamp_ns)

    def near(
        self,
        image: U8,
        T_map_camera: SE3,
        turn_known: bool = False,
        among: Sequence[int] | None = None,
        without: I64 = NOTHING,
        shutter: Shutter = GLOBAL,
    ) -> Found | None:
        """Look where the map should be if the camera is about there.

        Args:
            T_map_camera: Approximate pose of the camera.
            turn_known: Whether the rotation is known from a gyro.
            among: Keyframes to look for; all by default.
            without: Numbers of points not to look for.
            shutter: How the camera turned while the rows of the image were taken.
        """
        least = MIN_FOUND_TURN_KNOWN if turn_known else MIN_FOUND
        candidates = list(range(len(self.map.keyframes)) if among is None else among)
        ids = np.setdiff1d(self.map.seen_by(candidates), without)
        expected, inside = visible(self.map.positions[ids], T_map_camera, self.camera)
        ids, expected = ids[inside], expected[inside]
        seen = (self.map, candidates, T_map_camera, self.T_rig_camera, ids, KEYFRAMES, least)
        chosen = keyframes_in_view(*seen) or keyframes_in_view(*seen, MAX_TURN_DEG)
        again, found = find_in_keyframes(
            self.map,
            chosen,
            ids,
            image,
            shutter.in_image(expected),
            self.parameters.patch_px,
            LEVELS,
        )
        rotation_sigma = TURN_SIGMA if turn_known else None
        return self._agreed(again, found, shutter, T_map_camera, least, rotation_sigma)

    def find(self, frame: Frame, T_map_camera: SE3, turn_known: bool) -> Found | None:
        """Look where the map should be, then anywhere."""
        there = self.near(frame.image, T_map_camera, turn_known, shutter=frame.shutter)
        return there or self.anywhere(frame.image, frame.shutter)

    def anywhere(self, image: U8, shutter: Shutter = GLOBAL) -> Found | None:
        """Compare the image with all keyframes."""
        found = self._index.find(image, self.camera, self._places)
        # Descriptors find the place, patches the pixel.
        return None if found is None else self.near(image, found.fit.T_map_camera, shutter=shutter)

    def resembling(self, keyframe: Keyframe, among: list[int]) -> list[int]:
        """Stamps of those keyframes of some that may show the place of another [ns]."""
        stamps = [self.map.keyframes[k].stamp_ns for k in among]
        return self._index.resembling(keyframe.stamp_ns, stamps)

    def recognize(self, keyframe: Keyframe, stamps_ns: list[int]) -> SE3 | None:
        """Where a keyframe's camera is by those of some stamps, as far as they are still there."""
        there = [stamp_ns for stamp_ns in stamps_ns if stamp_ns in self._index]
        found = self._index.find(keyframe.image, self.camera, self._places, there)
        return None if found is None else found.fit.T_map_camera

    def again(
        self, keyframe: Keyframe, T_map_camera: SE3, among: list[int], without: I64
    ) -> Found | None:
        """Look for the points of old keyframes in another whose camera is about there; some points
        do not count."""
        shutter = keyframe.shutter
        return self.near(
            keyframe.image, T_map_camera, among=among, without=without, shutter=shutter
        )

    def _places(self, ids: I64) -> F64:
        """(n, 3) positions of points, NaN where they have none."""
        return np.where(self.map.mapped(ids)[:, None], self.map.positions[ids], np.nan)

    def _agreed(
        self,
        ids: I64,
        pixels: F32,
        shutter: Shutter,
        T_map_camera: SE3,
        least: int,
        rotation_sigma: float | None,
    ) -> Found | None:
        """The pose by points that were found, if they agree."""
        placed = self.map.mapped(ids)
        ids, seen = ids[placed], pixels[placed].astype(np.float64)
        if len(ids) < least:
            return None
        fit = estimate_pose(
            self.map.positions[ids],
            shutter.straight(seen),
            np.full(len(ids), self.parameters.corner_sigma_px),
            self.camera,
            T_map_camera,
            rotation_sigma=rotation_sigma,
            position_sigma=None,
        )
        good = fit.inliers
        if good.sum() < least or good.mean() < 0.5:
            return None
        return Found(ids[good], seen[good], fit)
