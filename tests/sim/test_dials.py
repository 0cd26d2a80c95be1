"""What sweeps turn in scenes and sensors; by default nothing is turned."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest

from airground.errors import InputError
from sim.appearance.sheet import faded
from sim.geometry.rubble import make_heap
from sim.robots.motion import simulate_motion
from sim.robots.overlap import driven_path, overlap_along_flight
from sim.scene import Scene, load_scene
from sim.sensors.imu import measure_field
from sim.sensors.presets import HARSH, NOMINAL, NONE, SensorPreset
from sim.sensors.turned import with_heading_error, with_noise
from sim.world.magnetic_field import EARTH_FIELD_WORLD
from sim.world.world import World, build_world

TINY = load_scene("tiny")


def world(scene: Scene, seed: int = 0) -> World:
    return build_world(scene, seed, pictures=False)


def with_overlap(share: float) -> Scene:
    ground = TINY.ground.model_copy(update={"stop_at_overlap": share})
    return TINY.model_copy(update={"ground": ground})


@pytest.mark.parametrize("share", [0.55, 0.65, 0.75])
def test_the_robot_stops_at_the_overlap_that_is_asked_for(share: float) -> None:
    for seed in (0, 1):
        found = float(np.median(overlap_along_flight(world(with_overlap(share), seed))))
        assert found == pytest.approx(share, abs=0.06)


def test_the_drive_is_the_same_until_it_stops_and_the_heap_throughout() -> None:
    whole, part = world(TINY), world(with_overlap(0.6))
    for one, other in zip(whole.boxes, part.boxes, strict=True):
        np.testing.assert_array_equal(one.corners(), other.corners())
    driven = driven_path(part).waypoints
    assert len(driven) < len(TINY.ground.waypoints)
    np.testing.assert_allclose(driven[:-1], TINY.ground.waypoints[: len(driven) - 1])
    moved = simulate_motion(part, part.scene, 1).ground
    np.testing.assert_allclose(moved.velocities_world[-1], 0, atol=1e-9)
    np.testing.assert_allclose(moved.positions_world[-1, :2], driven[-1][:2], atol=0.06)


def test_without_it_the_robot_drives_all_the_way() -> None:
    assert driven_path(world(TINY)) is TINY.ground


@pytest.mark.parametrize("share", [0.05, 0.99])
def test_an_overlap_that_cannot_be_had_is_refused(share: float) -> None:
    with pytest.raises(InputError, match=r"as it sets off and 0\.\d\d on its whole drive"):
        driven_path(world(with_overlap(share)))


def test_larger_boxes_make_a_higher_heap() -> None:
    def height(scale: float) -> float:
        assert TINY.rubble is not None
        rubble = TINY.rubble.model_copy(update={"size_scale": scale})
        boxes = make_heap(TINY.model_copy(update={"rubble": rubble}), np.random.default_rng(5))
        return float(np.median([box.corners()[:, 2].max() for box in boxes]))

    heights = [height(scale) for scale in (0.25, 0.5, 1.0)]
    assert heights[0] < 0.7 * heights[1] < 0.7**2 * heights[2]


def test_fading_keeps_the_mean_colour_and_scales_the_contrast() -> None:
    picture = np.random.default_rng(0).uniform(0, 255, (40, 30, 3)).astype(np.float32)
    assert faded(picture, 1.0) is picture
    half, none = faded(picture, 0.5), faded(picture, 0.0)
    np.testing.assert_allclose(half.mean((0, 1)), picture.mean((0, 1)), rtol=1e-4)
    np.testing.assert_allclose(half.std((0, 1)), 0.5 * picture.std((0, 1)), rtol=1e-4)
    assert np.ptp(none, axis=(0, 1)).max() == 0
    assert half.dtype == np.float32


@pytest.mark.parametrize("preset", [NONE, NOMINAL, HARSH], ids=lambda preset: preset.name)
def test_noise_is_scaled_and_nothing_else(preset: SensorPreset) -> None:
    assert with_noise(preset, 1.0) == preset
    double = asdict(with_noise(preset, 2.0))
    same = {"vignetting", "exposure_drift", "exposure_s", "gamma", "disparity_step_px", "range_m"}
    same |= {"grazing_limit_deg", "grazing_spread_deg"}
    for sensor in ("image", "depth", "imu"):
        for name, value in (asdict(preset)[sensor] or {}).items():
            times = 1 if name in same else 4 if name == "shot_noise" else 2
            expected = value if times == 1 else times * value
            assert double[sensor][name] == pytest.approx(expected), name
    assert double["magnetic"] == asdict(preset)["magnetic"]
    assert double["calibration"] == asdict(preset)["calibration"]


@pytest.mark.parametrize("preset", [NONE, NOMINAL], ids=lambda preset: preset.name)
def test_headings_are_off_by_what_is_asked_for(preset: SensorPreset) -> None:
    noise = with_heading_error(preset, 5.0).magnetic
    stamps = np.arange(20, dtype=np.int64)
    field = np.tile(EARTH_FIELD_WORLD, (20, 1))
    headings = []
    for seed in range(400):
        rng = np.random.default_rng(seed)
        said = measure_field(stamps, field, np.zeros((20, 3)), noise, rng).field.mean(0)
        headings.append(np.degrees(np.arctan2(said[1], said[0])))
    assert np.std(headings) == pytest.approx(5.0, rel=0.12)
