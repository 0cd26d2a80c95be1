"""Built worlds: the same bytes for the same seed, pictures where they belong, heights right."""

import mujoco
import numpy as np
import pytest

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.appearance.bake_light import LightBaker
from sim.appearance.floor import paint_concrete, paint_plain
from sim.appearance.pictures import CUBE_FACES, add_picture
from sim.geometry.surface import box_mesh, join, rectangle_mesh
from sim.recording.render import Renderer, with_cameras
from sim.scene import Light, Scene, load_scene
from sim.world.world import World, build_world, painted


def small(name: str = "tiny", **changes: object) -> Scene:
    """A scene with few boxes, whose pictures are painted in a second."""
    scene = load_scene(name)
    rubble = scene.rubble.model_copy(update={"boxes": 4})
    room = scene.room.model_copy(update={"size_m": (4.8, 3.0), "wall_height_m": 1.0})
    return scene.model_copy(update={"rubble": rubble, "room": room, **changes})


def textures(world: World) -> bytes:
    model = world.spec.compile()
    return bytes(model.tex_data)


def test_the_same_seed_gives_the_same_bytes() -> None:
    first, again = build_world(small(), 5), build_world(small(), 5)
    assert first.vertices.tobytes() == again.vertices.tobytes()
    assert textures(first) == textures(again)


def test_geometry_does_not_depend_on_pictures() -> None:
    plain, whole = build_world(small(), 5, pictures=False), build_world(small(), 5)
    assert plain.vertices.tobytes() == whole.vertices.tobytes()
    names = [[geom.name for geom in world.spec.geoms] for world in (plain, whole)]
    assert names[0] == names[1]


def test_a_plain_world_is_painted_as_one_built_with_pictures() -> None:
    later, whole = painted(build_world(small(), 5, pictures=False)), build_world(small(), 5)
    assert later.vertices.tobytes() == whole.vertices.tobytes()
    assert textures(later) == textures(whole)


def test_another_seed_gives_another_world_with_the_same_paths() -> None:
    worlds = [build_world(small(), seed, pictures=False) for seed in (1, 2)]
    assert worlds[0].vertices.tobytes() != worlds[1].vertices.tobytes()
    assert worlds[0].scene == worlds[1].scene


def test_nothing_in_a_world_moves() -> None:
    for name in ("tiny", "outdoor", "flat"):
        model = build_world(load_scene(name), 0, pictures=False).spec.compile()
        assert model.nv == 0


def test_floor_height_of_a_room_is_zero_inside_and_missing_outside() -> None:
    world = build_world(load_scene("flat"), 0, pictures=False)
    heights = world.floor_height(np.array([0.0, 4.9, 5.1]), 0.0)
    assert heights[:2].tolist() == [0.0, 0.0]
    assert np.isnan(heights[2])


def test_floor_height_of_terrain_lies_on_its_triangles() -> None:
    world = build_world(load_scene("outdoor"), 0, pictures=False)
    ground_vertices, triangles = world.terrain.mesh()
    weights = np.random.default_rng(0).dirichlet([1, 1, 1], len(triangles))
    points = np.einsum("tk,tkc->tc", weights, ground_vertices[triangles])
    assert world.floor_height(points[:, 0], points[:, 1]) == pytest.approx(points[:, 2], abs=1e-9)
    assert float(world.floor_height(0.0, 0.0)) == pytest.approx(0.0, abs=1e-12)


def test_each_picture_of_a_cube_lies_on_its_face_and_the_right_way_up() -> None:
    """Columns brighten red, rows green, and every face has its own blue."""
    side = 32
    ramp = np.linspace(20, 230, side)
    cube = np.zeros((6, side, side, 3), np.uint8)
    cube[..., 0], cube[..., 1] = ramp[None, None, :], ramp[None, :, None]
    cube[..., 2] = (40 * np.arange(6) + 10)[:, None, None]
    spec = mujoco.MjSpec()
    spec.visual.headlight.active = 0
    add_picture(spec, "cube", cube.reshape(6 * side, side, 3), cube=True)
    half = np.array([0.3, 0.2, 0.15])
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half, material="cube")
    camera = PinholeCamera(60, 60, 285.0, 285.0, 29.5, 29.5)
    with Renderer(with_cameras(spec, {"camera": camera})) as renderer:
        for index, (normal, columns, rows) in enumerate(CUBE_FACES):
            rotation = np.stack([columns, rows, -np.array(normal)], axis=1)
            picture, _ = renderer.draw("camera", SE3(rotation, 2.0 * np.array(normal)))
            seen = picture.astype(int)
            middle = seen[30, 30]
            assert middle == pytest.approx([125, 125, 40 * index + 10], abs=8)
            assert seen[30, 40, 0] > middle[0] + 5
            assert seen[40, 30, 1] > middle[1] + 5


def test_light_falls_off_in_shadow_and_is_soft_at_its_edge() -> None:
    floor = rectangle_mesh(np.array([-5.0, -5, 0]), np.array([10.0, 0, 0]), np.array([0, 10.0, 0]))
    box = box_mesh(np.array([0.5, 0.5, 0.5]), SE3(np.eye(3), np.array([0, 0, 0.25])))
    mesh = join([floor, box])
    light = Light(azimuth_deg=0, elevation_deg=45, radius_deg=6, main=0.6, fill=0, ambient=0.4)
    baker = LightBaker.of(mesh, np.full((len(mesh[1]), 3), 0.3), light)
    x = np.linspace(-1.2, 4.0, 400)
    points = np.stack([x, np.zeros_like(x), np.zeros_like(x)], axis=1)
    shade = baker.shade(points, np.tile([0.0, 0, 1], (400, 1)))[:, 1]
    assert shade[-1] == pytest.approx(1.0, abs=0.01)
    deepest = np.interp(-0.4, x, shade)
    assert deepest < 0.75 * shade[-1]
    edge = (x > -1.0) & (x < -0.5)
    between = (shade[edge] > deepest * 1.1) & (shade[edge] < 0.93)
    assert between.sum() > 4


def test_plain_boxes_carry_less_ink_and_their_shapes_stay() -> None:
    def with_print(share: float) -> Scene:
        scene = small()
        rubble = scene.rubble.model_copy(update={"printed": share})
        return scene.model_copy(update={"rubble": rubble})

    whole, part = build_world(small(), 5), build_world(with_print(0.0), 5)
    assert whole.vertices.tobytes() == part.vertices.tobytes()
    assert textures(build_world(with_print(1.0), 5)) == textures(whole)
    dark = [np.mean(np.frombuffer(textures(world), np.uint8) < 60) for world in (part, whole)]
    assert dark[0] < 0.8 * dark[1]


def test_a_plain_floor_has_less_contrast_than_concrete() -> None:
    rng = np.random.default_rng(0)
    plain, concrete = (paint((2.0, 2.0), 240.0, rng) for paint in (paint_plain, paint_concrete))
    assert plain.std() < 0.6 * concrete.std()
