"""The camera's pose at each image, relative to keyframes that may still move.

Where the way to the next keyframe was noted, too, images between the two follow both: what the
keyframes' adjustment changed between them is spread over the images by time, so that no step from
one image to the next takes all of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from airground.core.arrays import F64, I64
from airground.core.se3 import SE3, nearest_rotation
from airground.core.trajectory import Trajectory
from airground.slam.sparse_map import Keyframe

FIRST_IMAGES = 1024


class TrackedPath:
    """Every image with a published pose, in order of time; keyframes are known by their stamps.

    An image hangs on an anchor, the keyframe that was the newest. Anchors that were culled hang on
    a keyframe that was not: after an hour there are thousands, so that all are moved at once.
    """

    def __init__(self) -> None:
        self.clear()

    def __len__(self) -> int:
        return self._count

    def clear(self) -> None:
        self._count = 0
        self._stamps = np.empty(FIRST_IMAGES, np.int64)
        self._anchor_of = np.empty(FIRST_IMAGES, np.int64)
        self._relative = np.empty((FIRST_IMAGES, 3, 4))
        # Of each anchor: its stamp, that of the keyframe it hangs on, and its pose in that.
        self._anchors = np.empty(0, np.int64)
        self._held_by = np.empty(0, np.int64)
        self._in_holder = np.empty((0, 3, 4))
        self._ways: dict[int, tuple[int, SE3]] = {}

    def note(self, stamp_ns: int, T_map_camera: SE3, keyframes: Sequence[Keyframe]) -> None:
        """Remember an image's pose relative to the newest keyframe."""
        newest = keyframes[-1]
        if not len(self._anchors) or self._anchors[-1] != newest.stamp_ns:
            self._anchors = np.append(self._anchors, newest.stamp_ns)
            self._held_by = np.append(self._held_by, newest.stamp_ns)
            self._in_holder = np.concatenate([self._in_holder, np.eye(4)[None, :3]])
        if self._count == len(self._stamps):
            self._stamps = np.concatenate([self._stamps, np.empty_like(self._stamps)])
            self._anchor_of = np.concatenate([self._anchor_of, np.empty_like(self._anchor_of)])
            self._relative = np.concatenate([self._relative, np.empty_like(self._relative)])
        relative = newest.state.pose().inverse() @ T_map_camera
        self._stamps[self._count] = stamp_ns
        self._anchor_of[self._count] = len(self._anchors) - 1
        self._relative[self._count] = relative.matrix()[:3]
        self._count += 1

    def lead(self, stamp_ns: int, T_map_rig: SE3, keyframes: Sequence[Keyframe]) -> None:
        """Note the tracked way from the newest keyframe to an image that becomes the next one."""
        newest = keyframes[-1]
        self._ways[newest.stamp_ns] = stamp_ns, newest.state.pose().inverse() @ T_map_rig

    def rehang(self, culled: Keyframe, onto: Keyframe) -> None:
        """What hangs on a keyframe hangs on another from now on."""
        relative = onto.state.pose().inverse() @ culled.state.pose()
        moving = np.flatnonzero(self._held_by == culled.stamp_ns)
        self._held_by[moving] = onto.stamp_ns
        self._in_holder[moving] = _chained(relative.matrix()[None, :3], self._in_holder[moving])

    def scale(self, scale: float, lever: F64) -> None:
        """Follow a map whose distances grew by a factor, but not the (3,) place `lever` of the
        camera in the rig."""
        positions = self._relative[: self._count, :, 3]
        positions[:] = scale * (positions - lever) + lever
        turned = lever - self._in_holder[:, :, :3] @ lever
        places = self._in_holder[:, :, 3]
        places[:] = scale * (places - turned) + turned

    def trajectory(self, keyframes: Sequence[Keyframe]) -> Trajectory | None:
        """`T_map_camera` where the keyframes are now; None before the first image."""
        if not self._count:
            return None
        anchors = self._anchor_poses(keyframes)
        anchor_of, relative = self._anchor_of[: self._count], self._relative[: self._count]
        if self._ways:
            relative = self._spread(anchor_of, relative, anchors)
        poses = _chained(anchors[anchor_of], relative)
        return Trajectory(self._stamps[: self._count].copy(), poses[:, :, :3], poses[:, :, 3])

    def _anchor_poses(self, keyframes: Sequence[Keyframe]) -> F64:
        """(K, 3, 4) `T_map_rig` of the anchors."""
        stamps = np.array([keyframe.stamp_ns for keyframe in keyframes])
        order = np.argsort(stamps)
        poses = np.array([keyframe.state.pose().matrix()[:3] for keyframe in keyframes])
        holders = order[np.searchsorted(stamps, self._held_by, sorter=order)]
        return _chained(poses[holders], self._in_holder)

    def _spread(self, anchor_of: I64, relative: F64, anchors: F64) -> F64:
        """(n, 3, 4) relative poses, each with its share of what changed on the way to the next
        keyframe since it was tracked."""
        row_of = {int(stamp): row for row, stamp in enumerate(self._anchors)}
        stamps = self._stamps[: self._count]
        turns, shifts = np.zeros((2, len(stamps), 3))
        for stamp_ns, (next_ns, T_tracked) in self._ways.items():
            if stamp_ns not in row_of or next_ns not in row_of:
                continue
            here, there = (_pose(anchors[row_of[stamp]]) for stamp in (stamp_ns, next_ns))
            change = here.inverse() @ there @ T_tracked.inverse()
            row = row_of[stamp_ns]
            rows = slice(*np.searchsorted(anchor_of, [row, row + 1]))
            share = (stamps[rows, None] - stamp_ns) / (next_ns - stamp_ns)
            turns[rows] = share * change.rotation_vector()
            shifts[rows] = share * change.translation
        rotations = Rotation.from_rotvec(turns).as_matrix()
        spread: F64 = rotations @ relative
        spread[:, :, 3] += shifts
        return spread


def _pose(rows: F64) -> SE3:
    return SE3(nearest_rotation(rows[:, :3]), rows[:, 3])


def _chained(first: F64, second: F64) -> F64:
    """(n, 3, 4) upper rows of the products of two lists of motions."""
    chained: F64 = first[:, :, :3] @ second
    chained[:, :, 3] += first[:, :, 3]
    return chained
