"""Edges of boxes, of a floor, and of a rock in the ground."""

from pathlib import Path

import numpy as np
import pytest

from airground.core.se3 import SE3
from sim.geometry.edges import Edges, find_edges
from sim.geometry.surface import box_mesh, join, rectangle_mesh
from sim.geometry.terrain import HeightField
from sim.scene import load_scene
from sim.world.world import build_world

AT = SE3.from_rotation_vector((0.3, -0.5, 0.2), (1.0, 2.0, 3.0))


def shown(edges: Edges, eye: np.ndarray) -> np.ndarray:
    """Which edges show from a place, if nothing hides them."""
    front = edges.planes[:, :3] @ eye > edges.planes[:, 3]
    one, other = front[edges.faces].T
    return (one != other) | (one & other & edges.creased)


def lengths(edges: Edges) -> np.ndarray:
    return np.linalg.norm(edges.ends[:, 1] - edges.ends[:, 0], axis=1)


def test_a_box_has_twelve_edges_and_no_diagonals() -> None:
    edges = find_edges(box_mesh(np.array([0.2, 0.3, 0.5]), AT))
    assert np.sort(lengths(edges)) == pytest.approx(np.repeat([0.2, 0.3, 0.5], 4))
    assert edges.creased.all()


@pytest.mark.parametrize(
    ("eye_box", "count"), [((2, 0, 0), 4), ((2, 2, 0), 7), ((2, 2, 2), 9), ((-2, 2, -2), 9)]
)
def test_of_a_box_the_edges_of_its_near_faces_show(eye_box: tuple, count: int) -> None:
    edges = find_edges(box_mesh(np.ones(3), AT))
    assert shown(edges, AT @ np.array(eye_box, float)).sum() == count


def test_a_floor_has_a_rim_that_shows_from_above() -> None:
    edges = find_edges(rectangle_mesh(np.zeros(3), [2.0, 0, 0], [0, 1.0, 0]))
    assert np.sort(lengths(edges)) == pytest.approx([1, 1, 2, 2])
    assert shown(edges, np.array([0.0, 0, 1])).all()
    assert not shown(edges, np.array([0.0, 0, -1])).any()


def test_a_hollow_is_no_outline_and_a_ridge_is() -> None:
    """Two slopes that meet at a shallow angle, below their rims or above them."""
    for height, count in ((-0.1, 4), (0.1, 5)):
        left = np.array([[-1, 0, 0], [0, 0, height], [0, 1, height], [-1, 1, 0]], float)
        right = np.array([[0, 0, height], [1, 0, 0], [1, 1, 0], [0, 1, height]], float)
        triangles = np.array([[0, 1, 2], [0, 2, 3]])
        edges = find_edges(join([(left, triangles), (right, triangles)]))
        # The two slopes' rims are six sides, of which the fold is none.
        assert len(edges.ends) == count + 2
        assert edges.creased.sum() == 6


def test_what_stands_in_the_ground_has_a_waterline() -> None:
    nodes = np.linspace(-1, 1, 21)
    slope = HeightField(np.broadcast_to(0.3 * nodes[:, None], (21, 21)).copy(), np.array([2.0, 2]))
    ground = slope.mesh()
    post = box_mesh(np.array([0.2, 0.2, 1.0]), SE3.from_rotation_vector((0, 0, 0.4)))
    alone = find_edges(join([ground, post]))
    standing = find_edges(join([ground, post]), slope)
    line = standing.ends[len(alone.ends) :]
    assert line[..., 2] == pytest.approx(slope.at(line[..., 0], line[..., 1]), abs=1e-9)
    round_about = np.linalg.norm(line[:, 1, :2] - line[:, 0, :2], axis=1).sum()
    assert round_about == pytest.approx(0.8)
    assert standing.creased[len(alone.ends) :].all()
    seen_from = line.mean((0, 1)) + np.array([5.0, 0, 1])
    assert 0 < shown(standing, seen_from)[len(alone.ends) :].sum() < len(line)


def test_every_box_of_a_heap_keeps_its_edges(tmp_path: Path) -> None:
    world = build_world(load_scene("tiny"), seed=0, pictures=False)
    edges = find_edges((world.vertices, world.triangles), world.terrain)
    of_boxes = np.concatenate([np.repeat(box.size_m, 4) for box in world.boxes])
    found = np.sort(lengths(edges))
    places = np.searchsorted(found, of_boxes - 1e-9)
    assert found[places] == pytest.approx(of_boxes, abs=1e-6)
    assert len(found) >= len(of_boxes)
    edges.save(tmp_path / "edges.npz")
    back = Edges.load(tmp_path / "edges.npz")
    for name in ("ends", "faces", "creased", "planes"):
        np.testing.assert_array_equal(getattr(back, name), getattr(edges, name))


def test_the_ground_does_not_stand_in_itself() -> None:
    heights = np.random.default_rng(0).normal(0, 0.05, (23, 31))
    ground = HeightField(heights, np.array([1.7, 2.3]))
    assert len(find_edges(ground.mesh(), ground).ends) == len(find_edges(ground.mesh()).ends)
