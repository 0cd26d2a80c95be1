"""Recordings of one robot alone: its bytes are those of a recording of both."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from airground.io.digests import path_digest
from airground.io.header import read_header
from airground.io.recording_folder import RecordingFolder
from sim.recording import recorder
from sim.recording.recorder import record
from sim.robots.motion import ROBOTS, Robot
from sim.scene import Scene, load_scene, parse_scene
from sim.sensors.presets import NOMINAL, REAL, SensorPreset
from tests.sim.small_flight import FRAMES, SCENE, few_stamps, unpainted

FOLDERS: dict[Robot, str] = {"mav": "mav0", "ground": "ground"}
WHOLE = ("recording.toml", "truth/exposure.csv")
"""Files that state both robots in one."""
CHANGING = SCENE.replace("[rubble]\n", "[rubble]\nchanged = 0.5\n")


def other(robot: Robot) -> Robot:
    return "ground" if robot == "mav" else "mav"


def contents(folder: Path) -> dict[str, str]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path_digest(path) for path in files}


def assert_same_bytes(alone: Path, both: Path, robot: Robot) -> None:
    """All files are there that are not the other robot's, and no others; digests are right."""
    found, whole = contents(alone), contents(both)
    absent = f"{FOLDERS[other(robot)]}/"
    assert set(found) == {name for name in whole if not name.startswith(absent)}
    assert not (alone / absent).exists()
    for name, digest in found.items():
        assert name in WHOLE or digest == whole[name], name
    RecordingFolder.open(alone).verify()
    header, of_both = read_header(alone / "recording.toml"), read_header(both / "recording.toml")
    assert header.frames.robots() == (robot,)
    assert header.calibration == of_both.calibration
    assert header.digests.items() <= of_both.digests.items()


@pytest.fixture(scope="module", params=["real", "changing"])
def flight(request: pytest.FixtureRequest) -> tuple[Scene, SensorPreset]:
    """Automatic exposure, lenses and rolling shutters; and a world of each robot's own."""
    if request.param == "real":
        return parse_scene(SCENE, "small.toml"), REAL
    return parse_scene(CHANGING, "small.toml"), NOMINAL


@pytest.fixture(scope="module")
def both(
    flight: tuple[Scene, SensorPreset], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Path]:
    """A recording of both robots; recordings made meanwhile are as short."""
    scene, preset = flight
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", few_stamps)
        patch.setattr(recorder, "painted", unpainted)
        yield record(scene, 3, preset, tmp_path_factory.mktemp("both") / "both", workers=1)


@pytest.mark.parametrize("robot", ROBOTS)
def test_one_robots_bytes_are_those_beside_the_other(
    both: Path, flight: tuple[Scene, SensorPreset], robot: Robot, tmp_path: Path
) -> None:
    scene, preset = flight
    shown: list[tuple[int, int]] = []
    alone = record(
        scene,
        3,
        preset,
        tmp_path / "alone",
        workers=1,
        robots=(robot,),
        progress=lambda done, total: shown.append((done, total)),
    )
    assert_same_bytes(alone, both, robot)
    assert shown[-1] == (FRAMES, FRAMES)
    if preset is REAL:
        lines = (both / "truth" / "exposure.csv").read_text().splitlines()
        own = [line for line in lines if not line.startswith(other(robot))]
        assert len(own) == 1 + FRAMES
        assert (alone / "truth" / "exposure.csv").read_text().splitlines() == own
    else:
        assert (alone / "truth" / "surface_mav.ply").exists()


@pytest.mark.slow
def test_in_a_scene_of_the_package_with_any_number_of_workers(tmp_path: Path) -> None:
    tiny, slow = load_scene("tiny"), replace(NOMINAL, every=6)
    both = record(tiny, 1, slow, tmp_path / "both", 8.0, workers=2)
    for robot in ROBOTS:
        alone = [
            record(tiny, 1, slow, tmp_path / f"{robot}{n}", 8.0, workers=n, robots=(robot,))
            for n in (1, 2)
        ]
        assert contents(alone[0]) == contents(alone[1])
        assert_same_bytes(alone[0], both, robot)
