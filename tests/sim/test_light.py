"""Other light in the flight than in the drive: the same geometry, another picture."""

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.errors import InputError
from sim.appearance.bake_light import DISPLAY_GAMMA, LightBaker
from sim.appearance.other_light import later_light, light_between
from sim.geometry.surface import box_mesh, join, rectangle_mesh
from sim.scene import Light, Scene, load_scene, parse_scene
from sim.world.world import World, build_world, flight_world
from tests.sim.test_scene import SMALL
from tests.sim.test_world import small

BACK = rectangle_mesh(np.array([-3.0, 4, 0]), np.array([6.0, 0, 0]), np.array([0, 0, 4.0]))
FLOOR = rectangle_mesh(np.array([-5.0, -5, 0]), np.array([10.0, 0, 0]), np.array([0, 10.0, 0]))


def picture(world: World, name: str) -> np.ndarray:
    return np.frombuffer(world.spec.texture(name).data, np.uint8).astype(float)


def scaled(light: Light, factor: float) -> Light:
    parts = {key: factor * getattr(light, key) for key in ("main", "fill", "ambient")}
    return light.model_copy(update=parts)


@pytest.fixture(scope="module")
def drive() -> World:
    return build_world(small(), 5)


def seen_in(drive: World, light: Light) -> World:
    """The world of the flight in this light."""
    scene = drive.scene.model_copy(update={"flight_light": light})
    return flight_world(build_world(scene, drive.seed, pictures=False))


def test_half_the_light_makes_pictures_so_much_darker_and_moves_nothing(drive: World) -> None:
    flight = seen_in(drive, scaled(drive.scene.light, 0.5))
    assert flight.vertices.tobytes() == drive.vertices.tobytes()
    assert flight.changes == ()
    for name in ("floor", "wall_0", "box_000"):
        before, after = picture(drive, name), picture(flight, name)
        fit = (before > 20) & (before < 250)
        assert np.median(after[fit] / before[fit]) == pytest.approx(
            0.5 ** (1 / DISPLAY_GAMMA), abs=0.01
        )


def test_later_light_is_warmer_and_throws_its_shadows_elsewhere(drive: World) -> None:
    flight = seen_in(drive, later_light(drive.scene.light))
    before, after = (picture(world, "floor").reshape(-1, 3) for world in (drive, flight))
    ratio = np.median(after / np.maximum(before, 1), axis=0)
    assert ratio[0] > 1.05 * ratio[1] > 1.1 * ratio[2]
    assert ratio.max() < 0.95
    # Shadows: the brightness that is left is not a multiple of what was there.
    shade = (after.mean(1) / np.maximum(before.mean(1), 1)) / ratio.mean()
    assert np.mean(np.abs(shade - 1) > 0.1) > 0.02


def test_the_same_light_is_no_other_world(drive: World) -> None:
    scene = drive.scene.model_copy(update={"flight_light": drive.scene.light})
    same = build_world(scene, drive.seed, pictures=False)
    assert flight_world(same, pictures=False) is same


def test_natural_ground_has_another_light_too() -> None:
    scene = load_scene("outdoor")
    terrain = scene.terrain.model_copy(update={"rocks": 3, "area_m": (2.5, 2.5)})
    room = scene.room.model_copy(update={"size_m": (4.0, 4.0)})
    paths = {
        "mav": scene.mav.model_copy(update={"start": (0.0, 0.0)}),
        "ground": scene.ground,
    }
    light = scaled(scene.light, 0.5)
    changed = {"terrain": terrain, "room": room, "flight_light": light, **paths}
    drive = build_world(scene.model_copy(update=changed), 1)
    flight = flight_world(drive)
    assert flight.vertices.tobytes() == drive.vertices.tobytes()
    ratio = picture(flight, "ground").mean() / picture(drive, "ground").mean()
    assert ratio == pytest.approx(0.5 ** (1 / DISPLAY_GAMMA), abs=0.02)


def test_a_lamp_lights_by_distance_and_shades_away_from_itself() -> None:
    box = box_mesh(np.array([0.4, 0.4, 0.4]), SE3(np.eye(3), np.array([1.0, 0, 0.2])))
    mesh = join([FLOOR, BACK, box])
    lamp = Light(lamp_m=(0.0, 0.0, 2.0), radius_deg=2, main=1.0, fill=0, ambient=0)
    baker = LightBaker.of(mesh, np.zeros((len(mesh[1]), 3)), lamp)

    def irradiance(points: list[list[float]], normal: list[float]) -> np.ndarray:
        shade = baker.shade(np.array(points), np.tile(normal, (len(points), 1)))
        return shade[:, 1] ** DISPLAY_GAMMA

    below, aside, shaded = irradiance([[0, 0, 0], [0, 2, 0], [1.35, 0, 0]], [0.0, 0, 1])
    assert below == pytest.approx(1.0, abs=0.01)
    assert aside == pytest.approx(0.5**1.5, abs=0.01)  # cos^3 of 45 deg
    assert shaded < 0.05
    # A wall above the lamp is lit too: what lies behind the lamp does not hide it.
    (above,) = irradiance([[0.0, 4.0, 3.0]], [0.0, -1, 0])
    assert above == pytest.approx((4 / 17**0.5) * 4 / 17, rel=0.03)


def test_keys_that_the_flight_leaves_out_are_those_of_the_drive() -> None:
    tables = "[light]\nmain = 0.7\nradius_deg = 3\n[flight_light]\nmain = 0.2\n[room]"
    scene = parse_scene(SMALL.replace("[room]", tables), "small.toml")
    assert scene.flight_light is not None
    assert (scene.light.main, scene.flight_light.main) == (0.7, 0.2)
    assert scene.flight_light.radius_deg == 3
    assert Scene.model_validate(scene.model_dump()) == scene


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ("[flight_light]\nlamp = 1", r"unknown key 'flight_light\.lamp'; known here are azimuth"),
        ("[flight_light]\nlamp_m = [0, 0, 0.5]", r"flight_light\.lamp_m\.2 = 0\.5: .*than 1\.1"),
    ],
)
def test_a_mistake_in_the_light_is_named(tables: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_scene(SMALL.replace("[room]", f"{tables}\n[room]"), "small.toml")


def test_between_two_lights_the_sun_goes_the_shorter_way() -> None:
    one, other = Light(azimuth_deg=170, main=0.6), Light(azimuth_deg=-170, main=0.2)
    assert light_between(one, other, 0.0) == one
    half = light_between(one, other, 0.5)
    assert (half.azimuth_deg, half.main) == (180.0, pytest.approx(0.4))
    assert light_between(one, other, 1.0).main == other.main
    lamps = [Light(lamp_m=place) for place in ((0.0, 0.0, 2.0), (2.0, 0.0, 3.0))]
    assert light_between(*lamps, 0.5).lamp_m == (1.0, 0.0, 2.5)
    with pytest.raises(InputError, match="lamp_m must be in both"):
        light_between(one, lamps[0], 0.5)
