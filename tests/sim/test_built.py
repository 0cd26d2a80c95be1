"""What people have built: racks that repeat exactly, debris that rests and leaves room below."""

import numpy as np
import pytest

from airground.errors import InputError
from sim.appearance.bake_light import LightBaker
from sim.appearance.built_pictures import paint_built
from sim.appearance.cardboard import Make
from sim.geometry.debris import drop_debris
from sim.geometry.lane import distance_to_footprint, lane_points
from sim.geometry.shelves import stand_shelves
from sim.geometry.surface import BOX_TRIANGLES, RayCaster, box_mesh, join, rectangle_mesh
from sim.scene import Scene, load_scene, parse_scene
from sim.world.world import World, build_world

SMALL = """
name = "small"
description = "For tests."
kind = "built"
duration_s = 20.0
overlap_expected = 0.8
[room]
size_m = [5.0, 5.0]
[shelves]
rows = 2
bays = 3
period_m = [1.2, 1.8]
[mav]
start = [0.0, 0.0]
takeoff_s = 2.0
height_m = 2.4
waypoints = [[0.0, 0.0], [1.0, 0.0]]
[ground]
waypoints = [[-2.0, 0.0, 0], [2.0, 0.0, 0]]
"""


def small(**shelves: object) -> Scene:
    scene = parse_scene(SMALL, "small.toml")
    assert scene.shelves is not None
    return scene.model_copy(update={"shelves": scene.shelves.model_copy(update=shelves)})


@pytest.fixture(scope="module")
def collapsed() -> World:
    return build_world(load_scene("collapsed"), 0, pictures=False)


def test_racks_look_the_same_after_a_shift_by_a_period() -> None:
    boxes = stand_shelves(small(), np.random.default_rng(0))
    floor = rectangle_mesh(np.array([-3.0, -3, 0]), np.array([6.0, 0, 0]), np.array([0, 6.0, 0]))
    mesh = join([floor, *(box_mesh(box.size_m, box.T_world_box) for box in boxes)])
    caster = RayCaster(mesh)
    x, y = np.meshgrid(np.linspace(-1.7, -0.7, 101), np.linspace(-1.2, -0.6, 61))

    def depth(shift_x: float, shift_y: float) -> np.ndarray:
        rays = np.zeros((*x.shape, 6), np.float32)
        rays[..., 0], rays[..., 1], rays[..., 2], rays[..., 5] = x + shift_x, y + shift_y, 3.0, -1.0
        return caster.hits(rays)[0]

    for shift in ((1.2, 0), (0, 1.8), (1.2, 1.8)):
        differ = np.abs(depth(*shift) - depth(0, 0)) > 1e-3
        assert differ.mean() < 0.01  # rays that graze an edge
    assert np.mean(np.abs(depth(0.3, 0) - depth(0, 0)) > 1e-3) > 0.1


def test_empty_places_are_drawn_by_the_seed() -> None:
    full = stand_shelves(small(), np.random.default_rng(0))
    some, others = (stand_shelves(small(empty=0.3), np.random.default_rng(s)) for s in (0, 1))
    goods = [{tuple(b.T_world_box.translation) for b in boxes if b.kind == "box"}
             for boxes in (full, some, others)]  # fmt: skip
    assert len(goods[0]) == 2 * 3 * 3 * 2
    assert goods[1] < goods[0]
    assert len(goods[1]) == pytest.approx(0.7 * len(goods[0]), abs=9)
    assert goods[1] != goods[2]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("height_m = 2.4", "height_m = 1.5", r"mav\.height_m = 1\.5 must be at least 0\.4 above"),
        ("[shelves]\nrows = 2\nbays = 3\nperiod_m = [1.2, 1.8]\n", "",
         r"kind = 'built' needs one of the tables rubble, shelves, debris, street"),
        ("bays = 3", "bays = 3\nempty = 1.5", r"shelves\.empty = 1\.5"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line(old: str, new: str, message: str) -> None:
    assert old in SMALL
    with pytest.raises(InputError, match=message):
        parse_scene(SMALL.replace(old, new), "small.toml")


@pytest.mark.parametrize(
    ("shelves", "message"),
    [
        ({"bays": 5}, r"the shelves are 6\.06 m long along x, room\.size_m is 5"),
        ({"rows": 3}, r"ground\.waypoints pass closer than 0\.35 m to the rack at"),
        ({"depth_m": 1.9}, r"shelves\.depth_m must be below period_m"),
    ],
)
def test_racks_that_do_not_fit_are_refused(shelves: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        stand_shelves(small(**shelves), np.random.default_rng(0))


def test_repeated_things_have_one_picture_and_their_own_light() -> None:
    goods = [b for b in stand_shelves(small(), np.random.default_rng(0)) if b.kind == "box"][:8]
    floor = rectangle_mesh(np.array([-3.0, -3, 0]), np.array([6.0, 0, 0]), np.array([0, 6.0, 0]))
    mesh = join([floor, *(box_mesh(box.size_m, box.T_world_box) for box in goods)])
    make = Make.draw(np.random.default_rng(0), "X")
    albedo = np.full((len(mesh[1]), 3), 0.3)
    unlit, lit = (
        paint_built(goods, make, 1.0, LightBaker.of(mesh, albedo, light), np.random.default_rng(1))
        for light in (None, small().light)
    )
    assert all((picture == unlit[0]).all() for picture in unlit)
    assert any((picture != lit[0]).any() for picture in lit)


def test_debris_leaves_the_lane_free_and_stays_below_its_height(collapsed: World) -> None:
    debris = collapsed.scene.debris
    assert debris is not None
    lane = lane_points(collapsed.scene)
    for box in collapsed.boxes:
        assert distance_to_footprint(lane, box.corners()) >= debris.clearance_m - 1e-9
        assert box.corners()[:, 2].max() < debris.height_m
        assert box.corners()[:, 2].min() > -0.012
    kinds = [box.kind for box in collapsed.boxes]
    for kind, count in (("column", debris.columns), ("slab", debris.slabs), ("beam", debris.beams)):
        assert 0.6 * count <= kinds.count(kind) <= count


def test_slabs_lean_and_hide_ground_from_above(collapsed: World) -> None:
    """From a share of the ground below things a robot of 0.3 m would not reach the roof."""
    slabs = [box for box in collapsed.boxes if box.kind == "slab"]
    tilts = [np.degrees(np.arccos(abs(box.T_world_box.rotation[2, 2]))) for box in slabs]
    assert sum(10 < tilt < 80 for tilt in tilts) >= 4
    caster = RayCaster((collapsed.vertices, collapsed.triangles))
    x, y = np.meshgrid(np.linspace(-2.5, 2.5, 101), np.linspace(-2, 2, 81))
    up = np.zeros((*x.shape, 6), np.float32)
    up[..., 0], up[..., 1], up[..., 2], up[..., 5] = x, y, 0.01, 1.0
    gap, triangle = caster.hits(up)
    below = np.isfinite(gap) & (gap > 0.3)
    assert 0.03 < below.mean() < 0.5
    first = len(collapsed.triangles) - len(collapsed.boxes) * len(BOX_TRIANGLES)
    assert (triangle[below] >= first).all()


def test_debris_of_a_seed_is_always_the_same() -> None:
    scene = load_scene("collapsed")
    assert scene.debris is not None
    few = scene.debris.model_copy(update={"slabs": 3, "beams": 2, "bricks": 6, "columns": 2})
    scene = scene.model_copy(update={"debris": few})
    first, again, other = (drop_debris(scene, np.random.default_rng(s)) for s in (3, 3, 4))
    corners = [np.concatenate([box.corners() for box in boxes]) for boxes in (first, again, other)]
    assert (corners[0] == corners[1]).all()
    assert corners[0].shape != corners[2].shape or (corners[0] != corners[2]).any()


def test_parts_name_what_is_built(collapsed: World) -> None:
    kinds = {part.kind for part in collapsed.parts}
    assert {"ground", "slab", "beam", "brick", "column"} == kinds
