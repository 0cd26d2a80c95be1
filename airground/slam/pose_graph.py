"""Distributing the error of a loop over its keyframes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from airground.core.arrays import I64
from airground.core.se3 import SE3, nearest_rotation
from airground.slam.sparse_map import SparseMap

ROTATION_SIGMA, POSITION_SIGMA_M = 2e-3, 5e-3
"""What one shared point leaves open between two keyframes: a pixel, at 2 m [rad], [m]."""
MIN_SHARED = 15
"""Keyframes that share fewer points say little about each other ..."""
LEAST_POINTS = 1
"""... but neighbours in time never come apart: motion between them counts as one."""
LOOP_CERTAINTY = 10.0
"""The chain of keyframes drifted and the loop's own measurement did not: its sigmas are so many
times smaller than those of an edge with as many points."""


@dataclass(frozen=True, eq=False)
class Edge:
    """Pose of keyframe `second` in keyframe `first`, weighted by the number of shared points."""

    first: int
    second: int
    T_first_second: SE3
    points: float


def straighten(sparse_map: SparseMap, loop: Edge) -> None:
    """Move keyframes so that the loop closes; points go with the keyframe that saw them first.

    Neighbours in time, and keyframes that share points, keep their relative poses as well as
    they can: the better, the more points they share. The first keyframe stays; velocities turn
    with their keyframes.
    """
    before = [keyframe.state.pose() for keyframe in sparse_map.keyframes]
    certain = Edge(loop.first, loop.second, loop.T_first_second, loop.points * LOOP_CERTAINTY**2)
    after = optimize(before, [*_edges(sparse_map, before), certain])
    corrections = [new @ old.inverse() for new, old in zip(after, before, strict=True)]
    for keyframe, correction in zip(sparse_map.keyframes, corrections, strict=True):
        keyframe.state = keyframe.state.moved(correction)
    count = len(sparse_map)
    origins = sparse_map.origins[:count]
    rotations = np.array([correction.rotation for correction in corrections])[origins]
    shifts = np.array([correction.translation for correction in corrections])[origins]
    turned = np.einsum("nij,nj->ni", rotations, sparse_map.positions[:count])
    sparse_map.positions[:count] = turned + shifts


def optimize(poses: Sequence[SE3], edges: Sequence[Edge]) -> list[SE3]:
    """The poses `T_map_rig` that fit the edges best, by Levenberg-Marquardt (Open3D's, repeatable).
    The first pose is held; all keyframes must hang together by edges."""
    # 160 MiB in a process that only tracks, where most recordings close no loop.
    import open3d as o3d

    registration = o3d.pipelines.registration
    graph = registration.PoseGraph()
    for pose in poses:
        graph.nodes.append(registration.PoseGraphNode(pose.matrix()))
    for edge in edges:
        sharpness = [ROTATION_SIGMA**-2] * 3 + [POSITION_SIGMA_M**-2] * 3
        graph.edges.append(
            registration.PoseGraphEdge(
                edge.second,
                edge.first,
                edge.T_first_second.matrix(),
                edge.points * np.diag(sharpness),
                uncertain=False,
            )
        )
    registration.global_optimization(
        graph,
        registration.GlobalOptimizationLevenbergMarquardt(),
        registration.GlobalOptimizationConvergenceCriteria(),
        registration.GlobalOptimizationOption(reference_node=0),
    )
    found = [np.asarray(node.pose) for node in graph.nodes]
    return [SE3(nearest_rotation(pose[:3, :3]), pose[:3, 3]) for pose in found]


def covisibility(sparse_map: SparseMap) -> I64:
    """(K, K) how many points of the map two keyframes share."""
    keyframes = sparse_map.keyframes
    seen = [keyframe.ids[sparse_map.mapped(keyframe.ids)] for keyframe in keyframes]
    starts = np.cumsum([0] + [len(ids) for ids in seen])
    ids = np.concatenate(seen)
    shape = (len(keyframes), len(sparse_map))
    sees = csr_array((np.ones(len(ids), np.int64), ids, starts), shape=shape)
    result: I64 = (sees @ sees.T).toarray()
    return result


def _edges(sparse_map: SparseMap, poses: list[SE3]) -> list[Edge]:
    shared = covisibility(sparse_map)
    edges = []
    for i, j in np.argwhere(np.triu(shared >= MIN_SHARED, 2)):
        edges.append(Edge(int(i), int(j), poses[i].inverse() @ poses[j], float(shared[i, j])))
    for i in range(len(poses) - 1):
        points = float(max(shared[i, i + 1], LEAST_POINTS))
        edges.append(Edge(i, i + 1, poses[i].inverse() @ poses[i + 1], points))
    return edges
