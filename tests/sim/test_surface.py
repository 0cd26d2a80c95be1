"""The true surface is what MuJoCo sees: ray for ray, and side for side."""

import mujoco
import numpy as np
import pytest

from sim.geometry.surface import BOX_CORNERS, BOX_TRIANGLES, RayCaster, join, rectangle_mesh
from sim.scene import load_scene
from sim.world.world import World, build_world


@pytest.fixture(scope="module", params=["tiny", "outdoor", "flat"])
def world(request: pytest.FixtureRequest) -> World:
    return build_world(load_scene(request.param), seed=1, pictures=False)


def test_rays_meet_the_mesh_where_they_meet_mujocos_geoms(world: World) -> None:
    model = world.spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rng = np.random.default_rng(0)
    origins = rng.uniform([-1.5, -1.2, 1.2], [1.5, 1.2, 2.5], (400, 3))
    directions = rng.standard_normal((400, 3)) * [0.5, 0.5, 0.2] - [0, 0, 1.0]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    visible = np.array([1, 1, 1, 0, 0, 0], np.uint8)
    hit, normal = np.zeros(1, np.int32), np.zeros(3)
    expected = np.array(
        [
            mujoco.mj_ray(model, data, o, d, visible, 1, -1, hit, normal)
            for o, d in zip(origins, directions, strict=True)
        ]
    )
    rays = np.concatenate([origins, directions], axis=1).astype(np.float32)
    distance, _ = RayCaster((world.vertices, world.triangles)).hits(rays)
    assert (np.isfinite(distance) == (expected >= 0)).all()
    both = expected >= 0
    assert both.sum() > 350
    off = np.abs(distance[both] - expected[both])
    # A ray that grazes an edge may pass on either side of it.
    assert np.median(off) < 2e-6
    assert np.mean(off < 1e-4) > 0.99


def test_triangles_face_outward(world: World) -> None:
    """Seen from above, the first triangle on a vertical ray faces up."""
    places = np.random.default_rng(1).uniform(-1.2, 1.2, (300, 2))
    rays = np.zeros((300, 6), np.float32)
    rays[:, :2], rays[:, 2], rays[:, 5] = places, 3.0, -1.0
    _, triangle = RayCaster((world.vertices, world.triangles)).hits(rays)
    a, b, c = (world.vertices[world.triangles[triangle, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_a_boxs_triangles_enclose_its_volume() -> None:
    a, b, c = (BOX_CORNERS[BOX_TRIANGLES[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(8.0)


def test_joining_keeps_every_triangle_in_place() -> None:
    one = rectangle_mesh(np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    two = rectangle_mesh(np.ones(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    vertices, triangles = join([one, two])
    assert (vertices[triangles[:2]] == one[0][one[1]]).all()
    assert (vertices[triangles[2:]] == two[0][two[1]]).all()
