"""The true surface of a world: one triangle mesh of all that can be seen, and rays against it."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from airground.core.se3 import SE3

# Corners of a unit box as signs of (x, y, z), and its faces as triangles that wind
# counter-clockwise seen from outside.
BOX_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
BOX_TRIANGLES = np.array(
    [
        [0, 1, 3], [0, 3, 2],  # -x
        [4, 6, 7], [4, 7, 5],  # +x
        [0, 4, 5], [0, 5, 1],  # -y
        [2, 3, 7], [2, 7, 6],  # +y
        [0, 2, 6], [0, 6, 4],  # -z
        [1, 5, 7], [1, 7, 3],  # +z
    ]
)  # fmt: skip

Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Vertices (V, 3) [m] and triangles (T, 3) of vertex indices."""


def box_mesh(size_m: NDArray[np.float64], T_world_box: SE3) -> Mesh:
    """The 12 triangles of a box with full edge lengths `size_m` (3,) [m]."""
    return T_world_box @ (BOX_CORNERS * np.asarray(size_m) / 2), BOX_TRIANGLES


def rectangle_mesh(corner: NDArray, edge_u: NDArray, edge_v: NDArray) -> Mesh:
    """Two triangles over the parallelogram at `corner`; its front is along u x v."""
    corner, edge_u, edge_v = (np.asarray(a, np.float64) for a in (corner, edge_u, edge_v))
    vertices = np.stack([corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v])
    return vertices, np.array([[0, 1, 2], [0, 2, 3]])


def join(meshes: Iterable[Mesh]) -> Mesh:
    """One mesh of many; no vertices are merged."""
    vertices: list[NDArray] = []
    triangles: list[NDArray] = []
    offset = 0
    for part_vertices, part_triangles in meshes:
        vertices.append(part_vertices)
        triangles.append(part_triangles + offset)
        offset += len(part_vertices)
    return np.concatenate(vertices), np.concatenate(triangles)


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
