"""Where a world's surface has edges: outlines, creases, and lines along which things touch."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim.geometry.surface import Mesh
from sim.geometry.terrain import HeightField

_SAME_PLACE_M = 1e-6
# Where faces meet at less, light and pictures go on from one to the other.
_CREASE_DEG = 45.0


@dataclass(frozen=True, eq=False)
class Edges:
    """Every straight edge that may show from somewhere.

    Attributes:
        ends: (E, 2, 3) float64 ends of each edge, in `world` [m].
        faces: (E, 2) int64 the two triangles of each edge; the same twice if there is only one.
        creased: (E,) bool, whether an edge is visible when both triangles are.
        planes: (T, 4) float32 outward unit normal n of each triangle and the n @ x of its points.
    """

    ends: NDArray[np.float64]
    faces: NDArray[np.int64]
    creased: NDArray[np.bool_]
    planes: NDArray[np.float32]

    def save(self, path: Path) -> None:
        """Write to an `.npz` file."""
        np.savez(path, ends=self.ends, faces=self.faces, creased=self.creased, planes=self.planes)

    @classmethod
    def load(cls, path: Path) -> Edges:
        """Read what `save` wrote."""
        with np.load(path, allow_pickle=False) as stored:
            return cls(*(stored[name] for name in ("ends", "faces", "creased", "planes")))


def find_edges(mesh: Mesh, ground: HeightField | None = None) -> Edges:
    """The edges of a closed world seen from outside its solids.

    Vertices of `mesh` at the same place count as one. Lines along which it enters natural `ground`
    are edges, too.
    """
    vertices, triangles = mesh
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    offsets = (normals * corners[:, 0]).sum(1)
    ends, faces = _sides(vertices, triangles)
    one, other = faces.T
    cosine = (normals[one] * normals[other]).sum(1)
    # An edge in a hollow is never an outline.
    outward = (normals[one] * corners[other].mean(1)).sum(1) < offsets[one] - 1e-9
    creased = (one == other) | (cosine < np.cos(np.deg2rad(_CREASE_DEG)))
    may_show = creased | outward
    ends, faces, creased = ends[may_show], faces[may_show], creased[may_show]
    if ground is not None:
        touching, face = _waterline(corners, ground)
        ends = np.concatenate([ends, touching])
        faces = np.concatenate([faces, np.stack([face, face], axis=1)])
        creased = np.concatenate([creased, np.ones(len(face), bool)])
    return Edges(ends, faces, creased, np.column_stack([normals, offsets]).astype(np.float32))


def _sides(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(E, 2, 3) the ends of all sides of triangles, and (E, 2) the first two that share each."""
    places = np.rint(vertices / _SAME_PLACE_M).astype(np.int64)
    _, first, place = np.unique(places, axis=0, return_index=True, return_inverse=True)
    pairs = place.ravel()[triangles[:, [0, 1, 1, 2, 2, 0]]].reshape(-1, 2)
    pairs.sort(axis=1)
    # One number a pair sorts far sooner than pairs do.
    keys, side, count = np.unique(
        pairs[:, 0] * len(first) + pairs[:, 1], return_inverse=True, return_counts=True
    )
    by_side = np.argsort(side.ravel(), kind="stable") // 3
    start = np.cumsum(count) - count
    faces = np.stack([by_side[start], by_side[start + (count > 1)]], axis=1)
    ends = np.stack([keys // len(first), keys % len(first)], axis=1)
    return vertices[first[ends]], faces


def _waterline(
    corners: NDArray[np.float64], ground: HeightField
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """(S, 2, 3) where triangles (T, 3, 3) cross the ground, straight, and (S,) which ones."""
    above = corners[..., 2] - ground.at(corners[..., 0], corners[..., 1])
    above[np.abs(above) < 1e-9] = np.nan  # the ground itself
    crossing = np.flatnonzero((above.min(1) < 0) & (above.max(1) > 0))
    corners, above = corners[crossing], above[crossing]
    following = np.roll(np.arange(3), -1)
    cut = above * above[:, following] < 0
    share = above / (above - above[:, following])
    points = corners + share[..., None] * (corners[:, following] - corners)
    return points[cut].reshape(-1, 2, 3), crossing
