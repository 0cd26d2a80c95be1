"""The lamp that the ground robot carries: as bright as a baked lamp at the same place."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.io.recording import Recording
from sim.appearance.bake_light import DISPLAY_GAMMA
from sim.recording import recorder
from sim.recording.carried_lamp import CarriedLamp
from sim.recording.recorder import record
from sim.recording.render import Renderer, with_cameras
from sim.scene import Light, parse_scene
from sim.sensors.presets import NONE
from sim.world.world import World, build_world, unlit_world
from tests.sim.small_flight import SCENE, few_stamps
from tests.sim.test_world import small

CAMERA = PinholeCamera(320, 240, 300.0, 300.0, 159.5, 119.5)
ABOVE = SE3(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 2.0]))
DARK = Light(main=0, fill=0, ambient=0)
BEAM_DEG = 60.0


def drawn(world: World) -> tuple[np.ndarray, np.ndarray]:
    with Renderer(with_cameras(world.spec, {"camera": CAMERA})) as renderer:
        return renderer.draw("camera", ABOVE)


def off_axis_deg() -> np.ndarray:
    return np.degrees(np.arccos(1 / np.linalg.norm(CAMERA.rays(), axis=-1)))


def test_it_is_as_bright_as_a_baked_lamp_at_the_same_place() -> None:
    plain = build_world(small(), 5, pictures=False)
    unlit, depth = drawn(unlit_world(plain))
    dark, _ = drawn(build_world(small(light=DARK), 5))
    baked_lamp = DARK.model_copy(update={"lamp_m": (0.0, 0.0, 2.0), "main": 0.25, "radius_deg": 1})
    white = baked_lamp.model_copy(update={"main_colour": (1.0, 1.0, 1.0)})
    baked, _ = drawn(build_world(small(light=white), 5))
    lamp = CarriedLamp(irradiance=0.25 * 2.0**2, beam_deg=BEAM_DEG)
    lit = lamp.lit(dark, unlit, depth, CAMERA.rays())
    beam = 0.5 ** ((off_axis_deg() / BEAM_DEG) ** 2)
    expected = baked * beam[..., None] ** (1 / DISPLAY_GAMMA)
    bright = baked.min(-1) > 30
    assert bright.mean() > 0.7
    ratio = lit[bright].astype(float) / expected[bright]
    assert np.median(ratio) == pytest.approx(1.0, abs=0.02)
    # The rest is the sides of boxes, where light is baked in cells.
    assert np.mean(np.abs(ratio - 1) < 0.08) > 0.9


def test_no_light_and_no_surface_change_nothing() -> None:
    rng = np.random.default_rng(0)
    picture, unlit = rng.integers(0, 256, (2, 240, 320, 3)).astype(np.uint8)
    depth = np.full((240, 320), 1.5, np.float32)
    rays = CAMERA.rays()
    np.testing.assert_array_equal(CarriedLamp(0.0, 30.0).lit(picture, unlit, depth, rays), picture)
    depth[:, 100:] = np.nan
    lit = CarriedLamp(1.0, 30.0).lit(picture, unlit, depth, rays)
    np.testing.assert_array_equal(lit[:, 100:], picture[:, 100:])
    assert (lit[:, :100] >= picture[:, :100]).all()
    assert (lit[:, :100] > picture[:, :100]).mean() > 0.5


@pytest.fixture
def _few_images() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", few_stamps)
        yield


@pytest.mark.slow
@pytest.mark.usefixtures("_few_images")
def test_only_the_ground_robot_has_the_lamp(tmp_path: Path) -> None:
    scene = parse_scene(SCENE, "small.toml").model_copy(update={"light": DARK})
    lamp = scene.ground.model_copy(update={"lamp": 1.0})
    recordings = [
        Recording.open(record(changed, 3, NONE, tmp_path / name, workers=1))
        for name, changed in (("dark", scene), ("lit", scene.model_copy(update={"ground": lamp})))
    ]
    dark, lit = (recording.ground.read_image(1) for recording in recordings)
    np.testing.assert_array_equal(dark.depth, lit.depth)
    near = lit.depth < 2
    assert lit.colour[near].mean() > dark.colour[near].mean() + 30
    above = [recording.mav.read_image(1).image for recording in recordings]
    np.testing.assert_array_equal(*above)
    assert not list((tmp_path / "lit").glob("*unlit*"))
