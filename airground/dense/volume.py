"""The volume of interest of one surface, as voxels (Sec. V and VIII-B).

The voxels are those of a camera frustum: pixels of a reference view by planes evenly spaced in
depth. All lie in the field of view. Steps are even in depth, not in inverse depth: the error of a
crossing is a share of the step, and most of what the MAV sees is at the far end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F64
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.core.surface import DepthMap

ROBUST_PERCENT = 0.2
"""Share of a depth map's nearest and farthest pixels that do not stretch the volume [%]."""


@dataclass(frozen=True)
class Volume:
    """Voxels [row, plane, column] before a reference view at `T_mav_camera`.
    The pixels of `camera` are the columns; the planes lie from `near_m` to `far_m`."""

    camera: PinholeCamera
    T_mav_camera: SE3
    near_m: float
    far_m: float
    planes: int

    @classmethod
    def around(
        cls,
        depth_maps: list[DepthMap],
        reference: DepthMap,
        voxels: tuple[int, int, int],
        margin_m: float,
    ) -> Volume:
        """The volume before `reference` that holds what all depth maps saw.

        Args:
            depth_maps: Depth maps; ValueError if no depth is finite.
            reference: The depth map in whose view the surface will be cast.
            voxels: Columns, rows and planes.
            margin_m: Room before the nearest and behind the farthest depth [m].
        """
        depths = []
        for depth_map in depth_maps:
            T_reference_map = reference.T_mav_camera.inverse() @ depth_map.T_mav_camera
            points = depth_map.camera.back_project(depth_map.depth)[::3, ::3].reshape(-1, 3)
            z = (T_reference_map @ points[np.isfinite(points[:, 2])])[:, 2]
            if len(z):
                depths.append(np.percentile(z, [ROBUST_PERCENT, 100 - ROBUST_PERCENT]))
        if not depths:
            raise ValueError("no depth map has a finite depth")
        near, far = np.min(depths, axis=0)[0], np.max(depths, axis=0)[1]
        return cls(
            resized(reference.camera, voxels[0], voxels[1]),
            reference.T_mav_camera,
            float(max(near - margin_m, 0.2 * near)),
            float(far + margin_m),
            voxels[2],
        )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Rows, planes, columns."""
        return self.camera.height, self.planes, self.camera.width

    def depths(self) -> F64:
        """(planes,) depth of each plane [m]."""
        return np.linspace(self.near_m, self.far_m, self.planes)


def resized(camera: PinholeCamera, width: int, height: int) -> PinholeCamera:
    """The camera of the same field of view with other pixels."""
    sx, sy = width / camera.width, height / camera.height
    return PinholeCamera(
        width,
        height,
        camera.fx * sx,
        camera.fy * sy,
        (camera.cx + 0.5) * sx - 0.5,
        (camera.cy + 0.5) * sy - 0.5,
    )
