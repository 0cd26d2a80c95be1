"""A map that drifted along a ring is straightened by one loop."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.slam.pose_graph import Edge, covisibility, optimize, straighten
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import Keyframe, SparseMap

KEYFRAMES, POINTS, SEEN_BY = 40, 30, 4
RADIUS_M = 1.3
DRIFT = np.array([0.25, -0.15, 0.08, 0.0, np.deg2rad(1.0), np.deg2rad(5.0)])
"""Over the whole ring: 0.3 m and 5 deg, as a twist."""
NO_DRIFT = np.zeros(6)
LOOP = (0, KEYFRAMES - 1)


def ring(drift: NDArray[np.float64] = NO_DRIFT) -> list[SE3]:
    """Poses around a circle, with an error that grows from one to the next."""
    angles = 2 * np.pi * np.arange(KEYFRAMES) / KEYFRAMES
    true = [
        SE3.from_heading(a + np.pi / 2, RADIUS_M * np.array([np.cos(a), np.sin(a), 0.0]))
        for a in angles
    ]
    return [SE3.exp(k / (KEYFRAMES - 1) * drift) @ pose for k, pose in enumerate(true)]


def map_along(poses: list[SE3], seed: int = 0) -> SparseMap:
    """Keyframes that see points around them; each point is seen by the next few, too."""
    rng = np.random.default_rng(seed)
    sparse_map = SparseMap()
    in_rig = rng.uniform((1.0, -1.0, -1.0), (3.0, 1.0, 1.0), (KEYFRAMES * POINTS, 3))
    image = np.zeros((4, 4), np.uint8)
    for k, pose in enumerate(poses):
        made = sparse_map.new_points(np.zeros((POINTS, 2)), k)
        sparse_map.place(made, pose @ in_rig[made])
        ids = np.arange(max(0, k - SEEN_BY + 1) * POINTS, (k + 1) * POINTS)
        state = RigState(
            pose.rotation, pose.translation, pose.rotation[:, 0], np.zeros(3), np.zeros(3)
        )
        blank = np.zeros((len(ids), 2))
        sparse_map.keyframes.append(Keyframe(k, image, state, ids, blank, np.full(len(ids), 0.5)))
    return sparse_map


def loop_edge(points: float = 50.0) -> Edge:
    true = ring()
    return Edge(*LOOP, true[LOOP[0]].inverse() @ true[LOOP[1]], points)


def errors(sparse_map: SparseMap) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(K,) distance [m] and angle [deg] of each keyframe to the truth."""
    off = [
        true.inverse() @ keyframe.state.pose()
        for true, keyframe in zip(ring(), sparse_map.keyframes, strict=True)
    ]
    distances = np.array([np.linalg.norm(T.translation) for T in off])
    return distances, np.rad2deg([T.angle() for T in off])


def test_drift_around_a_ring_is_straightened() -> None:
    sparse_map = map_along(ring(DRIFT))
    metres, degrees = errors(sparse_map)
    assert metres[-1] > 0.25
    assert degrees[-1] > 4.9
    straighten(sparse_map, loop_edge())
    after_m, after_deg = errors(sparse_map)
    assert after_m[0] < 1e-9, "the first keyframe stays"
    assert after_m[-1] < 0.01
    assert after_deg[-1] < 0.2
    assert after_m.max() < 0.3 * metres.max()
    assert after_deg.max() < 0.3 * degrees.max()


def test_points_and_velocities_go_with_their_keyframes() -> None:
    sparse_map = map_along(ring(DRIFT))
    before = [keyframe.state.pose() for keyframe in sparse_map.keyframes]
    count = len(sparse_map)
    seen = np.array(
        [before[sparse_map.origins[i]].inverse() @ sparse_map.positions[i] for i in range(count)]
    )
    straighten(sparse_map, loop_edge())
    for i in range(0, count, 7):
        pose = sparse_map.keyframes[sparse_map.origins[i]].state.pose()
        np.testing.assert_allclose(pose @ seen[i], sparse_map.positions[i], atol=1e-9)
    for keyframe in sparse_map.keyframes:
        state = keyframe.state
        np.testing.assert_allclose(state.rotation.T @ state.velocity, [1.0, 0.0, 0.0], atol=1e-9)


def test_a_loop_that_closes_already_moves_nothing() -> None:
    sparse_map = map_along(ring())
    straighten(sparse_map, loop_edge())
    metres, degrees = errors(sparse_map)
    assert metres.max() < 1e-4
    assert degrees.max() < 1e-2


def test_a_link_with_few_points_gives_way() -> None:
    """Where tracking hung by a thread is where the map slipped."""
    weak, true = 20, ring()
    slip = SE3.from_heading(np.deg2rad(5.0), (0.2, -0.2, 0.0))
    slipped = true[:weak] + [slip @ pose for pose in true[weak:]]
    sparse_map = map_along(slipped)
    for k in range(weak, KEYFRAMES):
        keyframe = sparse_map.keyframes[k]
        keyframe.forget(sparse_map.origins[keyframe.ids] < weak)
    straighten(sparse_map, loop_edge())
    metres, degrees = errors(sparse_map)
    assert metres.max() < 0.05
    assert degrees.max() < 1.0


def test_the_same_graph_gives_the_same_bytes() -> None:
    def straightened() -> NDArray[np.float64]:
        sparse_map = map_along(ring(DRIFT))
        straighten(sparse_map, loop_edge())
        return np.array([keyframe.state.pose().matrix() for keyframe in sparse_map.keyframes])

    np.testing.assert_array_equal(straightened(), straightened())


def test_shared_points_are_counted_in_pairs_and_dropped_ones_left_out() -> None:
    sparse_map = map_along(ring())
    sparse_map.drop(np.arange(5))
    shared = covisibility(sparse_map)
    for i, j in [(0, 0), (0, 1), (0, 3), (0, 4), (7, 9), (30, 20)]:
        a, b = sparse_map.keyframes[i].ids, sparse_map.keyframes[j].ids
        both = np.intersect1d(a, b)
        assert shared[i, j] == sparse_map.mapped(both).sum()


@pytest.mark.parametrize("seed", range(3))
def test_exact_edges_lead_to_the_true_poses(seed: int) -> None:
    """From a poor guess, with more edges than needed."""
    rng = np.random.default_rng(seed)
    true = ring()
    pairs = [(k, k + 1) for k in range(KEYFRAMES - 1)] + [(k, k + 9) for k in range(0, 31, 3)]
    edges = [Edge(i, j, true[i].inverse() @ true[j], 40.0) for i, j in pairs]
    guess = true[:1] + [pose @ SE3.exp(rng.normal(0, 0.05, 6)) for pose in true[1:]]
    for found, pose in zip(optimize(guess, edges), true, strict=True):
        off = pose.inverse() @ found
        assert np.linalg.norm(off.translation) < 1e-3
        assert off.angle() < 1e-3
