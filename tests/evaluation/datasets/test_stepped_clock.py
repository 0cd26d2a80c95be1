"""Exports and renderings of a recording whose clocks step: the truth is that of the images."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evaluation import cli
from evaluation.datasets.formats import FORMATS
from evaluation.datasets.lidar_files import render_scans
from evaluation.datasets.mcap import _truth
from evaluation.datasets.simulated import Simulated
from sim.recording import recorder
from sim.recording.recorder import record
from sim.robots.motion import ROBOTS
from sim.scene import parse_scene
from sim.sensors.faults import Fault
from sim.sensors.lidar import Lidar
from sim.sensors.presets import NOMINAL
from tests.evaluation.conftest import images_in_flight
from tests.sim.small_flight import SCENE

STEPS_S = {"mav": (3.5, 0.0815), "ground": (3.4, 0.25)}
"""Time and size of each clock's step; the first is no multiple of the motion's 5 ms."""


@pytest.fixture(scope="module")
def stepped(tmp_path_factory: pytest.TempPathFactory) -> Simulated:
    """The flight of `simulated`, with other clocks."""
    faults = [
        Fault("clock", robot, 0.0, start_s=STEPS_S[robot][0], size=STEPS_S[robot][1])
        for robot in ROBOTS
    ]
    sensors = replace(NOMINAL, faults=tuple(faults))
    out = tmp_path_factory.mktemp("stepped") / "recording"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", images_in_flight)
        return Simulated.open(record(parse_scene(SCENE, "small.toml"), 3, sensors, out, workers=1))


def stamped_ns(robot: str, times_ns: np.ndarray) -> np.ndarray:
    start_s, size_s = STEPS_S[robot]
    return times_ns + (times_ns >= start_s * 1e9) * round(size_s * 1e9)


@pytest.mark.parametrize("robot", ROBOTS)
def test_true_poses_are_those_of_the_images(
    stepped: Simulated, simulated: Simulated, robot: str
) -> None:
    """Images with the same bytes have the same true pose, by whichever stamp."""
    stamps = stepped.stamps_ns(robot)  # type: ignore[arg-type]
    plain = simulated.stamps_ns(robot)[: len(stamps)]  # type: ignore[arg-type]
    assert len(stamps) > 10
    np.testing.assert_array_equal(stamps, stamped_ns(robot, np.array(plain)))
    assert stamps[-1] - plain[-1] == round(STEPS_S[robot][1] * 1e9)
    for index in (0, len(stamps) - 1):
        files = [one.image_files(robot)[index] for one in (stepped, simulated)]  # type: ignore[arg-type]
        assert files[0].read_bytes() == files[1].read_bytes()
        poses = [
            one.truth.T_world_camera(robot, stamp).matrix()  # type: ignore[arg-type]
            for one, stamp in ((stepped, stamps[index]), (simulated, plain[index]))
        ]
        np.testing.assert_array_equal(*poses)


def test_states_of_euroc_are_by_the_clock(
    stepped: Simulated, simulated: Simulated, tmp_path: Path
) -> None:
    tables = []
    for name, one in (("stepped", stepped), ("plain", simulated)):
        FORMATS["euroc"].write(tmp_path / name, one, ("mav",))
        states = tmp_path / name / "mav0" / "state_groundtruth_estimate0" / "data.csv"
        tables.append(np.loadtxt(states, delimiter=","))
    by_clock, by_time = tables
    np.testing.assert_array_equal(by_clock[:, 0], stamped_ns("mav", by_time[:, 0]))
    np.testing.assert_array_equal(by_clock[:, 1:11], by_time[:, 1:11])
    # Biases are smoothed errors of the samples, of which the last ones are cut off.
    assert np.abs(by_clock[:, 11:] - by_time[:, 11:]).max() < 0.05


@pytest.mark.parametrize("robot", ROBOTS)
def test_true_states_of_a_bag_are_by_the_clock(stepped: Simulated, robot: str) -> None:
    times = stepped.truth.motion.stamps_ns
    stamps = [stamp for stamp, *_ in _truth(stepped, robot)][::2]  # type: ignore[arg-type]
    np.testing.assert_array_equal(stamps, stamped_ns(robot, times))


def test_scans_are_named_by_the_clock(
    stepped: Simulated, simulated: Simulated, tmp_path: Path
) -> None:
    lidar, files = Lidar(beams=16), []
    for name, one in (("stepped", stepped), ("plain", simulated)):
        render_scans(one, lidar, 20, tmp_path / name, lambda: None)
        files.append(sorted((tmp_path / name / "ground_lidar").glob("*.pcd")))
    by_clock, by_time = ([int(file.stem) for file in one] for one in files)
    np.testing.assert_array_equal(sorted(by_clock), stamped_ns("ground", np.array(sorted(by_time))))
    assert max(by_clock) - max(by_time) == 250_000_000
    contents = [[file.read_bytes() for file in sorted(one, key=at)] for one in files]
    assert contents[0] == contents[1]


def at(file: Path) -> int:
    return int(file.stem)


def test_rendered_depth_is_that_of_the_image(
    stepped: Simulated, simulated: Simulated, tmp_path: Path
) -> None:
    written = []
    for name, one in (("stepped", stepped), ("plain", simulated)):
        words = ["render", str(one.recording.path), "--add", "depth", "--robot", "mav"]
        words += ["--every", "16", "--out", str(tmp_path / name)]
        with pytest.raises(SystemExit) as ended:
            cli.main(words)
        assert ended.value.code == 0
        written.append(sorted((tmp_path / name / "mav_depth").iterdir()))
    by_clock, by_time = ([file.read_bytes() for file in one[:2]] for one in written)
    assert len(by_clock) == 2
    assert by_clock == by_time
