"""Rays against a triangle mesh: Open3D's scene behind two plain functions of arrays."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from sim.geometry.surface import Mesh

NOTHING = np.uint32(o3d.t.geometry.RaycastingScene.INVALID_ID)


class RayCaster:
    """Holds a mesh. Rays are (..., 6) float32: origin [m] and direction of any length."""

    def __init__(self, mesh: Mesh) -> None:
        vertices, triangles = mesh
        self._scene = o3d.t.geometry.RaycastingScene(nthreads=2)
        self._scene.add_triangles(
            o3d.core.Tensor.from_numpy(vertices.astype(np.float32)),
            o3d.core.Tensor.from_numpy(triangles.astype(np.uint32)),
        )

    def blocked(self, rays: NDArray[np.float32]) -> NDArray[np.bool_]:
        """(...) whether a ray hits anything."""
        return self._scene.test_occlusions(o3d.core.Tensor.from_numpy(rays)).numpy()

    def hits(self, rays: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
        """(...) distance in lengths of the direction (infinite for none) and triangle hit."""
        answer = self._scene.cast_rays(o3d.core.Tensor.from_numpy(rays))
        return answer["t_hit"].numpy(), answer["primitive_ids"].numpy()
