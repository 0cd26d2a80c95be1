"""A robot's poses over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from airground.core.arrays import F64, I64, freeze, freeze_stamps
from airground.core.se3 import SE3, interpolate


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Stamped poses `T_frame_robot`, interpolated in between.

    Attributes:
        stamps_ns: (N,) int64, strictly increasing, N >= 1.
        rotations: (N, 3, 3) float64 rotations of the poses.
        translations: (N, 3) float64 positions [m].
    """

    stamps_ns: I64
    rotations: F64
    translations: F64

    def __post_init__(self) -> None:
        freeze_stamps(self)
        if len(self) == 0:
            raise ValueError("a trajectory needs at least one pose")
        freeze(self, "rotations", (len(self), 3, 3), np.float64)
        freeze(self, "translations", (len(self), 3), np.float64)
        if not (np.isfinite(self.rotations).all() and np.isfinite(self.translations).all()):
            raise ValueError("a pose is not finite")

    @classmethod
    def from_poses(cls, stamps_ns: list[int], poses: list[SE3]) -> Trajectory:
        return cls(
            np.array(stamps_ns, np.int64),
            np.array([pose.rotation for pose in poses]).reshape(-1, 3, 3),
            np.array([pose.translation for pose in poses]).reshape(-1, 3),
        )

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def __getitem__(self, index: int) -> SE3:
        return SE3(self.rotations[index], self.translations[index])

    def at(self, stamp_ns: int) -> SE3:
        """The pose at a time, linear in between; ValueError outside the first and last stamp."""
        first, last = int(self.stamps_ns[0]), int(self.stamps_ns[-1])
        if not first <= stamp_ns <= last:
            raise ValueError(f"stamp {stamp_ns} is outside the trajectory [{first}, {last}]")
        after = int(np.searchsorted(self.stamps_ns, stamp_ns, side="left"))
        if self.stamps_ns[after] == stamp_ns:
            return self[after]
        t0, t1 = self.stamps_ns[after - 1], self.stamps_ns[after]
        return interpolate(self[after - 1], self[after], float(stamp_ns - t0) / float(t1 - t0))

    def quaternions_xyzw(self) -> F64:
        """(N, 4) unit quaternions in TUM's order."""
        result: F64 = Rotation.from_matrix(self.rotations).as_quat()
        return result

    def path_m(self) -> float:
        """Length of the path [m]."""
        return float(np.linalg.norm(np.diff(self.translations, axis=0), axis=1).sum())
