"""A street: kerbs of the stated height, houses at the rim of the floor, a floor of bounded size."""

import numpy as np
import pytest

from airground.errors import InputError
from sim.appearance.floor import paint_asphalt
from sim.appearance.house_front import paint_front
from sim.geometry.street import lay_street
from sim.geometry.surface import RayCaster, box_mesh, join, rectangle_mesh
from sim.scene import Scene, load_scene, parse_scene
from sim.world.room import FLOOR_PX_PER_M, MOST_FLOOR_PX

TEXT = """
name = "small"
description = "For tests."
kind = "built"
duration_s = 20.0
overlap_expected = 0.8
[room]
size_m = [12.0, 10.0]
wall_height_m = 0.0
floor = "asphalt"
[street]
pavement_m = 2.0
kerb_m = 0.15
houses_m = 6.0
[debris]
area_m = [4.0, 4.0]
bricks = 4
[mav]
start = [0.0, 0.0]
takeoff_s = 2.0
height_m = 4.0
waypoints = [[0.0, 0.0], [1.0, 0.0]]
[ground]
waypoints = [[-2.0, 0.0, 0], [2.0, 0.0, 0]]
"""


def small() -> Scene:
    return parse_scene(TEXT, "small.toml")


def test_the_road_is_lower_than_the_pavements_by_the_kerb() -> None:
    boxes = lay_street(small(), np.random.default_rng(0))
    floor = rectangle_mesh(np.array([-6.0, -5, 0]), np.array([12.0, 0, 0]), np.array([0, 10.0, 0]))
    caster = RayCaster(join([floor, *(box_mesh(b.size_m, b.T_world_box) for b in boxes)]))
    x, y = np.meshgrid(np.linspace(-5.9, 5.9, 60), np.linspace(-4.65, 4.65, 94))
    rays = np.zeros((*x.shape, 6), np.float32)
    rays[..., 0], rays[..., 1], rays[..., 2], rays[..., 5] = x, y, 9.0, -1.0
    height = 9.0 - caster.hits(rays)[0]
    np.testing.assert_allclose(height, np.where(np.abs(y) > 3.0, 0.15, 0.0), atol=1e-5)


def test_houses_end_the_floor_on_both_sides() -> None:
    fronts = [b for b in lay_street(small(), np.random.default_rng(0)) if b.kind == "front"]
    corners = np.stack([box.corners() for box in fronts])
    assert len(fronts) == 4
    assert np.abs(corners[..., 1]).max() == pytest.approx(5.0)
    assert 4.5 <= corners[..., 2].max(1).min() <= corners[..., 2].max() <= 6.15
    without = small().street.model_copy(update={"houses_m": 0.0})
    scene = small().model_copy(update={"street": without})
    assert {b.kind for b in lay_street(scene, np.random.default_rng(0))} == {"pavement"}


def test_debris_has_to_lie_on_the_road() -> None:
    with pytest.raises(InputError, match=r"debris\.area_m\[1\] = 7\.0 must be at most 6"):
        parse_scene(TEXT.replace("area_m = [4.0, 4.0]", "area_m = [4.0, 7.0]"), "small.toml")


def test_pictures_of_street_and_houses_have_marks() -> None:
    rng = np.random.default_rng(0)
    road = paint_asphalt((6.0, 3.0), 100.0, rng)
    assert road.shape == (300, 600, 3)
    assert np.median(road) < 130 < road[145:155].max()
    front = paint_front((6.0, 6.0), 60.0, rng)
    assert np.mean(front.mean(-1) < 90) > 0.05  # windows


def test_only_a_floor_of_more_than_ten_by_ten_metres_is_coarser() -> None:
    assert MOST_FLOOR_PX >= (10 * FLOOR_PX_PER_M) ** 2
    street = load_scene("street").room.size_m
    assert street == (60.0, 20.0)
    assert np.sqrt(MOST_FLOOR_PX / np.prod(street)) > 420 / load_scene("street").mav.height_m
