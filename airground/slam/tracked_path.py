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
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.sparse_map import Keyframe

FIRST_IMAGES = 1024


class TrackedPath:
    """Every image with a published pose, in order of time; keyframes are known by their stamps. The
    images of a culled one go to another."""

    def __init__(self) -> None:
        self.clear()

    def __len__(self) -> int:
        return self._count

    def clear(self) -> None:
        self._count = 0
        self._stamps = np.empty((FIRST_IMAGES, 2), np.int64)
        self._poses = np.empty((FIRST_IMAGES, 3, 4))
        self._carried: dict[int, tuple[int, SE3]] = {}
        self._ways: dict[int, tuple[int, SE3]] = {}

    def note(self, stamp_ns: int, T_map_camera: SE3, keyframes: Sequence[Keyframe]) -> None:
        """Remember an image's pose relative to the newest keyframe."""
        newest = keyframes[-1]
        if self._count == len(self._stamps):
            self._stamps = np.concatenate([self._stamps, np.empty_like(self._stamps)])
            self._poses = np.concatenate([self._poses, np.empty_like(self._poses)])
        relative = newest.state.pose().inverse() @ T_map_camera
        self._stamps[self._count] = stamp_ns, newest.stamp_ns
        self._poses[self._count, :, :3] = relative.rotation
        self._poses[self._count, :, 3] = relative.translation
        self._count += 1

    def lead(self, stamp_ns: int, T_map_rig: SE3, keyframes: Sequence[Keyframe]) -> None:
        """Note the tracked way from the newest keyframe to an image that becomes the next one."""
        newest = keyframes[-1]
        self._ways[newest.stamp_ns] = stamp_ns, newest.state.pose().inverse() @ T_map_rig

    def rehang(self, culled: Keyframe, onto: Keyframe) -> None:
        """Images that hang on a keyframe hang on another from now on."""
        relative = onto.state.pose().inverse() @ culled.state.pose()
        self._carried[culled.stamp_ns] = onto.stamp_ns, relative

    def scale(self, scale: float, lever: F64) -> None:
        """Follow a map whose distances grew by a factor, but not the (3,) place `lever` of the
        camera in the rig."""
        positions = self._poses[: self._count, :, 3]
        positions[:] = scale * (positions - lever) + lever
        for culled, (onto, T) in self._carried.items():
            turned = lever - T.rotation @ lever
            place = scale * (T.translation - turned) + turned
            self._carried[culled] = onto, SE3(T.rotation, place)

    def trajectory(self, keyframes: Sequence[Keyframe]) -> Trajectory | None:
        """`T_map_camera` where the keyframes are now; None before the first image."""
        if not self._count:
            return None
        stamps, relative = self._stamps[: self._count], self._poses[: self._count]
        hung_on, row_of = np.unique(stamps[:, 1], return_inverse=True)
        poses = self._where(hung_on.tolist(), keyframes)
        rotations = np.array([poses[stamp].rotation for stamp in hung_on.tolist()])[row_of]
        positions = np.array([poses[stamp].translation for stamp in hung_on.tolist()])[row_of]
        if self._ways:
            relative = self._spread(stamps, relative, poses)
        return Trajectory(
            stamps[:, 0].copy(),
            rotations @ relative[:, :, :3],
            np.einsum("nij,nj->ni", rotations, relative[:, :, 3]) + positions,
        )

    def _spread(self, stamps: I64, relative: F64, poses: dict[int, SE3]) -> F64:
        """(n, 3, 4) relative poses, each with its share of what changed on the way to the next
        keyframe since it was tracked."""
        turns, shifts = np.zeros((2, len(stamps), 3))
        for stamp_ns, (next_ns, T_tracked) in self._ways.items():
            if stamp_ns not in poses or next_ns not in poses:
                continue
            change = poses[stamp_ns].inverse() @ poses[next_ns] @ T_tracked.inverse()
            rows = slice(*np.searchsorted(stamps[:, 1], [stamp_ns, stamp_ns + 1]))
            share = (stamps[rows, :1] - stamp_ns) / (next_ns - stamp_ns)
            turns[rows] = share * change.rotation_vector()
            shifts[rows] = share * change.translation
        rotations = Rotation.from_rotvec(turns).as_matrix()
        spread: F64 = rotations @ relative
        spread[:, :, 3] += shifts
        return spread

    def _where(self, stamps: list[int], keyframes: Sequence[Keyframe]) -> dict[int, SE3]:
        """`T_map_rig` of keyframes by their stamps, culled or not."""
        poses = {keyframe.stamp_ns: keyframe.state.pose() for keyframe in keyframes}
        for stamp in stamps:
            chain = [stamp]
            while chain[-1] not in poses:
                chain.append(self._carried[chain[-1]][0])
            for one in reversed(chain[:-1]):
                onto, relative = self._carried[one]
                poses[one] = poses[onto] @ relative
        return poses
