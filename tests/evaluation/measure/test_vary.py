"""`--vary`: what it says, what it refuses, and that the order of dials does not matter."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.config import Config
from airground.errors import InputError
from evaluation.measure.plans.dials import DIALS, Subject, turned
from evaluation.measure.plans.sweep import SweepPlan, Vary, parse_vary, points
from evaluation.measure.protocol.trials import Protocol
from evaluation.setup.setups import Setup
from sim.scene import load_scene
from sim.sensors.auto_exposure import CONSUMER_EXPOSURE
from sim.sensors.presets import NOMINAL, NONE

TINY = load_scene("tiny")
SUBJECT = Subject(TINY, NOMINAL, Config())


def test_values_are_read_as_in_toml() -> None:
    words = [
        "localization.particles=50, 200",
        "localization.heading=known,search",
        "fusion.voxels=[1, 2, 3],[4, 5, 6]",
        "scene.overlap=0.5",
    ]
    assert parse_vary(words) == (
        Vary("localization.particles", (50, 200)),
        Vary("localization.heading", ("known", "search")),
        Vary("fusion.voxels", ([1, 2, 3], [4, 5, 6])),
        Vary("scene.overlap", (0.5,)),
    )


def test_every_combination_is_a_point() -> None:
    varied = parse_vary(["scene.texture=0,1", "localization.particles=50,200,800"])
    found = points(varied)
    assert len(found) == 6
    assert found[0] == {"scene.texture": 0, "localization.particles": 50}
    assert found[1] == {"scene.texture": 0, "localization.particles": 200}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "name a dial and its values"),
        (["particles=5"], "expected NAME=VALUE"),
        (["localization.particles"], "expected NAME=VALUE"),
        (["localization.particles="], "expected NAME=VALUE"),
        (["scene.texture=0.5,0.5"], "listed twice"),
        (["scene.texture=0", "scene.texture=1"], "given twice"),
        ([f"localization.particles={','.join(map(str, range(1, 1100)))}"], "more than 1000"),
    ],
)
def test_wrong_words_get_one_line(words: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_vary(words)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("scene.gravity", 1.0, "unknown dial; known: scene.overlap"),
        ("sensors.gps", 1.0, "unknown dial"),
        ("localization.partciles", 5, "unknown key localization.partciles"),
        ("localizer.particles", 5, "unknown section 'localizer'"),
        ("localization.particles", 1, "greater than or equal to 2"),
        ("scene.texture", 1.5, "out of its range, 0 to 1"),
        ("scene.flight_height", 0.5, "out of its range, 1.2 to 10 m"),
        ("scene.texture", "rich", "'rich' is no number"),
        ("scene.texture", True, "True is no number"),
    ],
)
def test_a_dial_refuses_what_it_cannot_be(name: str, value: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        turned(SUBJECT, {name: value})


def test_a_scene_without_boxes_has_no_dials_for_them() -> None:
    flat = replace(SUBJECT, scene=load_scene("flat"))
    with pytest.raises(InputError, match=r"'flat' has no \[rubble\]"):
        turned(flat, {"scene.heap_height": 0.5})


def test_dials_of_natural_ground_turn_what_they_name() -> None:
    point = {
        "scene.plants": 30.0,
        "scene.stones": 100.0,
        "scene.clods": 0.03,
        "scene.rock_roughness": 0.01,
    }
    terrain = turned(replace(SUBJECT, scene=load_scene("outdoor")), point).scene.terrain
    assert terrain is not None
    assert (terrain.plants_per_m2, terrain.stones_per_m2) == (30.0, 100.0)
    assert (terrain.clods_m, terrain.rock_roughness_m) == (0.03, 0.01)


def test_dials_turn_what_they_name() -> None:
    point = {
        "scene.overlap": 0.6,
        "scene.self_similarity": 0.3,
        "scene.changed": 0.25,
        "scene.light": 0.5,
        "scene.lamp": 1.5,
        "scene.heap_height": 0.5,
        "scene.flight_height": 3.0,
        "scene.camera_height": 1.0,
        "scene.texture": 0.2,
        "scene.printed": 0.4,
        "sensors.noise": 2.0,
        "sensors.readout_ms": 20.0,
        "sensors.distortion": 0.5,
        "sensors.fisheye": 0.9,
        "sensors.depth_baseline_mm": 50.0,
        "sensors.depth_registered": 0.0,
        "sensors.auto_exposure": 0.5,
        "sensors.gamma": 0.8,
        "sensors.camera_hz": 15.0,
        "sensors.dropped_s": 2.0,
        "sensors.imu_gap_s": 0.5,
        "sensors.black_s": 0.1,
        "sensors.frozen_s": 0.2,
        "sensors.repeated_s": 0.9,
        "sensors.overexposed_s": 0.3,
        "sensors.depth_gone_s": 0.4,
        "sensors.imu_saturated_s": 0.6,
        "sensors.imu_silent_s": 0.7,
        "sensors.clock_step_s": 0.8,
        "sensors.heading_error_deg": 5.0,
        "height_maps.cells_per_m": 50.0,
    }
    of_terrain = {"scene.plants", "scene.stones", "scene.clods", "scene.rock_roughness"}
    assert {dial.name for dial in DIALS} - of_terrain < point.keys()
    subject = turned(SUBJECT, point)
    scene = subject.scene
    assert scene.rubble is not None
    assert (scene.rubble.self_similarity, scene.rubble.size_scale) == (0.3, 0.5)
    assert (scene.rubble.printed, scene.rubble.changed) == (0.4, 0.25)
    assert (scene.ground.stop_at_overlap, scene.ground.camera_height_m) == (0.6, 1.0)
    assert scene.ground.lamp == 1.5
    assert scene.flight_light is not None
    assert scene.flight_light.azimuth_deg == scene.light.azimuth_deg + 60
    assert (scene.mav.height_m, scene.texture) == (3.0, 0.2)
    assert subject.config.height_maps.cells_per_m == 50.0
    assert subject.sensors.image is not None
    assert subject.sensors.magnetic is not None
    assert subject.sensors.image.read_noise == 2 * NOMINAL.image.read_noise  # type: ignore[union-attr]
    assert subject.sensors.image.gamma == 0.8
    assert subject.sensors.exposure == replace(CONSUMER_EXPOSURE, strength=0.5)
    optics = subject.sensors.mav_optics, subject.sensors.ground_optics
    assert {(o.lens, o.distortion, o.readout_s) for o in optics} == {("equidistant", 0.9, 0.02)}
    assert (subject.sensors.depth_baseline_m, subject.sensors.depth_registered) == (0.05, False)
    assert subject.sensors.every == 2
    faults = {(one.kind, one.robot): one.duration_s for one in subject.sensors.faults}
    both = {"dropped": 2.0, "imu_gap": 0.5, "black": 0.1, "frozen": 0.2, "exposure": 0.3}
    both |= {"imu_saturated": 0.6, "imu_silent": 0.7, "repeated": 0.9}
    each = {(kind, robot): lasts for kind, lasts in both.items() for robot in ("mav", "ground")}
    assert faults == each | {("depth_gone", "ground"): 0.4, ("clock", "mav"): 0.0}
    (clock,) = [one for one in subject.sensors.faults if one.kind == "clock"]
    assert clock.size == 0.8
    assert len(subject.sensors.faults) == len(faults)
    # What is turned is still a valid scene.
    assert type(scene).model_validate(scene.model_dump()) == scene


@pytest.mark.parametrize("dial", DIALS, ids=lambda dial: dial.name)
def test_both_ends_of_a_range_are_allowed_as_messages_print_them(dial: object) -> None:
    outdoors = replace(SUBJECT, scene=load_scene("outdoor"))
    natural = ("plants", "stones", "clods", "rock_roughness")
    subject = outdoors if dial.name.endswith(natural) else SUBJECT  # type: ignore[attr-defined]
    for end in (dial.low, dial.high):  # type: ignore[attr-defined]
        value = float(f"{end:g}")
        scene = turned(subject, {dial.name: value}).scene  # type: ignore[attr-defined]
        assert type(scene).model_validate(scene.model_dump()) == scene


WORDS = (
    "scene.overlap=0.5,0.7",
    "sensors.noise=0,2",
    "sensors.heading_error_deg=1,5",
    "localization.particles=50,200",
    "scene.camera_height=0.6",
)


def keys(words: list[str]) -> set[str]:
    setup = Setup(Config())
    plan = SweepPlan(parse_vary(words), (TINY,), 2, setup, NOMINAL, Protocol(), 7)
    return {unit.key() for point in plan.points() for unit in plan.units(point)}


ALL_KEYS = keys(list(WORDS))


@settings(deadline=None)
@given(st.permutations(WORDS))
def test_the_order_of_dials_does_not_matter(words: list[str]) -> None:
    assert keys(words) == ALL_KEYS
    assert len(ALL_KEYS) == 2 * 2**4


def test_points_are_paired_by_seed_and_variants_of_localization_share_a_flight() -> None:
    setup = Setup(Config())
    varied = parse_vary(["localization.particles=50,200,800", "height_maps.cells_per_m=25,50"])
    plan = SweepPlan(varied, (TINY,), 3, setup, NONE, Protocol(), 7)
    for point in plan.points():
        assert [unit.seed for unit in plan.units(point)] == [7, 8, 9]
    assert plan.tasks() == 3
    over_scenes = parse_vary(["scene.texture=0.2,1", "localization.particles=50,200"])
    assert replace(plan, varied=over_scenes).tasks() == 6
