"""The true surface of a world, for rays and distances."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.errors import InputError, RecordingError
from airground.io.ply_elements import columns, read_elements
from sim.geometry.parts import Part, read_parts, write_parts

if TYPE_CHECKING:
    from sim.world.world import World

_EMPTY = np.zeros(0, [])


@dataclass(frozen=True, eq=False)
class TrueSurface:
    """The mesh of all that a robot can see, in `world`.

    Attributes:
        path: PLY file of the mesh.
        parts_path: CSV file of what its triangles belong to.
    """

    path: Path
    parts_path: Path

    @cached_property
    def mesh(self) -> o3d.geometry.TriangleMesh:
        """The mesh; RecordingError if it is missing or damaged."""
        path = self.path
        try:
            tables = read_elements(path, ("vertex", "face"))
            vertices = columns(path, tables.get("vertex", _EMPTY), ("x", "y", "z"))
        except InputError as error:
            raise RecordingError(str(error)) from None
        faces = tables.get("face", _EMPTY)
        names = faces.dtype.names or ()
        triangles = faces["vertex_indices"] if "vertex_indices" in names else np.zeros((0, 0))
        if triangles.shape[1:] != (3,) or len(triangles) == 0 or triangles.dtype.kind not in "iu":
            raise RecordingError(f"{path}: no readable mesh with triangles")
        if not np.isfinite(vertices).all():
            raise RecordingError(f"{path}: a vertex is not finite")
        if triangles.min() < 0 or triangles.max() >= len(vertices):
            raise RecordingError(f"{path}: a triangle has a vertex that is not there")
        return o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(triangles)
        )

    @cached_property
    def scene(self) -> o3d.t.geometry.RaycastingScene:
        """The mesh, ready for rays and distances."""
        scene = o3d.t.geometry.RaycastingScene()
        scene.add_triangles(
            o3d.core.Tensor.from_numpy(np.asarray(self.mesh.vertices).astype(np.float32)),
            o3d.core.Tensor.from_numpy(np.asarray(self.mesh.triangles).astype(np.uint32)),
        )
        return scene

    @property
    def parts(self) -> list[Part]:
        """What the triangles belong to, in their order.

        Raises:
            RecordingError: The list is missing or does not fit the mesh.
        """
        parts = read_parts(self.parts_path)
        listed, count = sum(part.triangles for part in parts), len(self.mesh.triangles)
        if listed != count:
            raise RecordingError(
                f"{self.parts_path}: lists {listed} triangles, {self.path.name} has {count}"
            )
        return parts

    def distance(self, points_world: NDArray) -> NDArray[np.float32]:
        """(N,) distance of points (N, 3) to the nearest point of the surface [m]."""
        points = np.ascontiguousarray(points_world, dtype=np.float32)
        return self.scene.compute_distance(o3d.core.Tensor.from_numpy(points)).numpy()

    def cast(self, camera: PinholeCamera, T_world_camera: SE3) -> NDArray[np.float32]:
        """(height, width) true depth [m] that any camera would see from anywhere."""
        directions = camera.rays() @ T_world_camera.rotation.T
        origins = np.broadcast_to(T_world_camera.translation, directions.shape)
        rays = np.concatenate([origins, directions], axis=-1).astype(np.float32)
        # Directions have z = 1 in the camera, so that their multiples are depths.
        depth = self.scene.cast_rays(o3d.core.Tensor.from_numpy(rays))["t_hit"].numpy()
        return np.where(np.isfinite(depth), depth, np.float32(np.nan))

    def write(self, world: World) -> None:
        """Write the surface of a world into both files."""
        mesh = o3d.geometry.TriangleMesh(
            o3d.utility.Vector3dVector(np.array(world.vertices)),
            o3d.utility.Vector3iVector(np.array(world.triangles)),
        )
        if not o3d.io.write_triangle_mesh(self.path, mesh):
            raise OSError(f"{self.path}: cannot be written")
        write_parts(self.parts_path, world.parts)
