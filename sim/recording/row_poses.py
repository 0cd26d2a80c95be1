"""Poses of a camera whose rows are taken one after the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import open3d as o3d
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.core.se3 import SE3
from airground.io.lens import Lens
from sim.robots.motion import Motion, Robot


@dataclass(frozen=True, eq=False)
class RowPoses:
    """A pose for each row, in some frame.

    Attributes:
        rotations: (H, 3, 3) rotations.
        translations: (H, 3) places [m].
    """

    rotations: NDArray[np.float64]
    translations: NDArray[np.float64]

    @classmethod
    def same(cls, pose: SE3, height: int) -> RowPoses:
        """One pose for all rows."""
        rotations = np.broadcast_to(pose.rotation, (height, 3, 3))
        return cls(rotations, np.broadcast_to(pose.translation, (height, 3)))

    @property
    def is_one(self) -> bool:
        """Whether all rows have the same pose, as with a global shutter."""
        return self.translations.strides[0] == 0

    def at(self, rows: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """(N, 3, 3) rotations and (N, 3) places [m] at rows (N,), between whole ones too."""
        above = np.minimum(rows.astype(np.int64), len(self.rotations) - 2)
        share = (rows - above)[:, None]
        # From one row to the next a camera turns by 0.2 mrad: a mean of two rotations is one.
        below = share[..., None] * self.rotations[above + 1]
        rotations = (1 - share[..., None]) * self.rotations[above] + below
        places = (1 - share) * self.translations[above] + share * self.translations[above + 1]
        return rotations, places

    def rays_world(self, rays: NDArray[np.float64]) -> o3d.core.Tensor:
        """(H, W, 6) float32 origins and directions in the frame of the poses, for Open3D.

        Args:
            rays: (H, W, 3) directions in the camera.
        """
        if self.is_one:  # one product over all rows, which differs in the last bit
            directions = rays @ self.rotations[0].T
        else:
            directions = rays @ self.rotations.transpose(0, 2, 1)
        origins = np.broadcast_to(self.translations[:, None], rays.shape)
        joined = np.concatenate([origins, directions], axis=-1).astype(np.float32)
        return o3d.core.Tensor.from_numpy(joined)

    def seen_from(self, T_frame_other: SE3) -> RowPoses:
        """The same poses in another frame."""
        T_other_frame = T_frame_other.inverse()
        return RowPoses(T_other_frame.rotation @ self.rotations, T_other_frame @ self.translations)


def row_time_ns(lens: Lens, middle_ns: int, row: float) -> int:
    """When a row is taken [ns]; the stamp is that of the middle of the image."""
    share = row / max(lens.height - 1, 1) - 0.5
    return middle_ns + round(share * lens.readout_s * 1e9)


def exact_row_poses(motion: Motion, robot: Robot, lens: Lens, middle_ns: int) -> RowPoses:
    """`T_world_camera` of every row of an image, by the stored motion."""
    if not lens.readout_s:
        return RowPoses.same(motion.camera_pose(robot, middle_ns), lens.height)
    times = [row_time_ns(lens, middle_ns, row) for row in range(lens.height)]
    poses = [motion.camera_pose(robot, time_ns) for time_ns in times]
    return RowPoses(
        np.array([pose.rotation for pose in poses]), np.array([pose.translation for pose in poses])
    )


def strip_poses(
    motion: Motion, robot: Robot, lens: Lens, middle_ns: int, rows: slice
) -> tuple[SE3, RowPoses]:
    """`T_world_camera` of the middle of a strip of rows, and of every row in it in that frame.

    Between the first, the middle and the last row the camera is taken to move evenly: in 2.5 ms
    a turn that speeds up by 30 rad/s^2 departs from it by 0.02 mrad, 0.01 px.
    """
    count, middle_row = rows.stop - rows.start, (rows.start + rows.stop - 1) / 2
    T_world_middle = motion.camera_pose(robot, row_time_ns(lens, middle_ns, middle_row))
    if not lens.readout_s:
        return T_world_middle, RowPoses(np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3)))
    ends = []
    for row in (rows.start, rows.stop - 1):
        end = motion.camera_pose(robot, row_time_ns(lens, middle_ns, row))
        moved = T_world_middle.inverse() @ end
        ends.append(np.concatenate([moved.translation, moved.rotation_vector()]))
    share = np.linspace(-1, 1, count)[:, None]
    moved = np.where(share < 0, -share * ends[0], share * ends[1])
    return T_world_middle, RowPoses(Rotation.from_rotvec(moved[:, 3:]).as_matrix(), moved[:, :3])
