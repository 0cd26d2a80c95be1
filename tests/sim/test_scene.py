"""Scene files: all that ship are valid, and mistakes are answered in one line."""

import numpy as np
import pytest

from airground.errors import InputError
from sim.robots.overlap import overlap_along_flight
from sim.scene import load_scene, parse_scene, scene_names
from sim.world.world import build_world

PAPER = ["paper_a", "paper_b", "paper_c", "paper_outdoor"]
SHIPPED = [
    "collapsed", "flat", "indoor_a", "indoor_b", "indoor_c", "meadow", "outdoor", *PAPER, "street",
    "tiny", "warehouse",
]  # fmt: skip

SMALL = """
name = "small"
description = "For tests."
kind = "rubble"
duration_s = 20.0
overlap_expected = 0.8
[room]
size_m = [5.0, 5.0]
[rubble]
boxes = 8
area_m = [2.5, 2.5]
edge_m = [0.2, 0.4]
[mav]
start = [0.0, 0.0]
takeoff_s = 2.0
waypoints = [[0.0, 0.0], [1.0, 0.0]]
[ground]
waypoints = [[-2.0, 0.0, 0], [2.0, 0.0, 0]]
"""


def test_every_shipped_scene_is_valid_and_named_like_its_file() -> None:
    assert scene_names() == SHIPPED
    for name in SHIPPED:
        assert load_scene(name).name == name


def test_a_scene_is_also_read_from_a_path(tmp_path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(SMALL)
    assert load_scene(str(file)).rubble.boxes == 8


def test_an_unknown_scene_lists_the_known_ones() -> None:
    with pytest.raises(InputError, match=r"unknown scene 'nowhere': known are collapsed, flat"):
        load_scene("nowhere")


def test_a_missing_file_is_named() -> None:
    with pytest.raises(InputError, match=r"no/such\.toml: cannot read"):
        load_scene("no/such.toml")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("boxes = 8", "boxes = 8\nbexes = 2", r"unknown key 'rubble\.bexes'; known here are boxes"),
        ("kind = ", "knd = 1\nkind = ", r"unknown key 'knd'; known here are name, description"),
        ("[5.0, 5.0]", "[-5.0, 5.0]", r"room\.size_m\.0 = -5\.0: .*greater than 0"),
        ("edge_m = [0.2, 0.4]", "edge_m = [0.4, 0.2]", r"rubble: edge_m: 0\.4 is longer than 0\.2"),
        ("expected = 0.8", "expected = 1.3", r"overlap_expected = 1\.3: .*equal to 1"),
        ("duration_s = 20.0", "duration_s = nan", r"duration_s = nan: .*finite number"),
        ("duration_s = 20.0", "", r"key 'duration_s' is missing"),
        ("[[-2.0, 0.0, 0]", "[[-9.0, 0.0, 0]", r"waypoint \[-9\.0, 0\.0\] lies outside room\.size"),
        ("takeoff_s = 2.0", "takeoff_s = 30.0", r"mav\.takeoff_s = 30\.0 must be below duration_s"),
        ('kind = "rubble"', 'kind = "flat"', r"kind = 'flat' has no use for the \[rubble\] table"),
        ('kind = "rubble"', 'kind = "terrain"', r"needs a|has no use"),
        ('kind = "rubble"', 'kind = "rubbel"', r"kind = 'rubbel': input should be 'rubble'"),
        ("[room]", "[room", r"not valid TOML"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_with_file_and_key(old: str, new: str, message: str) -> None:
    assert old in SMALL
    with pytest.raises(InputError, match=message) as caught:
        parse_scene(SMALL.replace(old, new, 1), "scenes/small.toml")
    assert str(caught.value).startswith("scenes/small.toml: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "name", ["tiny", *(pytest.param(n, marks=pytest.mark.slow) for n in SHIPPED if n != "tiny")]
)
def test_the_overlap_that_a_scene_states_is_the_one_it_gives(name: str) -> None:
    scene = load_scene(name)
    worlds = [build_world(scene, seed, pictures=False) for seed in (0, 1, 2)]
    overlaps = np.concatenate([overlap_along_flight(world) for world in worlds])
    assert float(np.median(overlaps)) == pytest.approx(scene.overlap_expected, abs=0.05)


@pytest.mark.parametrize("text", ["a = " + "[" * 50_000, "a." * 10_000 + "b = 1"])
def test_a_scene_nested_without_end_is_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"deep\.toml: not valid TOML"):
        parse_scene(text, "deep.toml")
