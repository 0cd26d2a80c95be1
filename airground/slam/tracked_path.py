"""Where the camera was when each image was taken, hung on keyframes that may still move."""

from __future__ import annotations

from collections.abc import Sequence

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.slam.sparse_map import Keyframe


class TrackedPath:
    """Every image whose pose was given out, in order of time."""

    def __init__(self) -> None:
        self._hung: list[tuple[int, int, SE3]] = []

    def __len__(self) -> int:
        return len(self._hung)

    def clear(self) -> None:
        """Give up all images."""
        self._hung.clear()

    def note(self, stamp_ns: int, T_map_camera: SE3, keyframes: Sequence[Keyframe]) -> None:
        """Remember an image's pose relative to the newest keyframe."""
        index = len(keyframes) - 1
        T_keyframe_map = keyframes[index].state.pose().inverse()
        self._hung.append((stamp_ns, index, T_keyframe_map @ T_map_camera))

    def trajectory(self, keyframes: Sequence[Keyframe]) -> Trajectory | None:
        """`T_map_camera` where the keyframes are now; None before the first image."""
        if not self._hung:
            return None
        poses = [keyframe.state.pose() for keyframe in keyframes]
        return Trajectory.from_poses(
            [stamp for stamp, _, _ in self._hung], [poses[k] @ T for _, k, T in self._hung]
        )
