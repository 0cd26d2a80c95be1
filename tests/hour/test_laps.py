"""Laps repeat to the last bit, and a recording of them is one like any other."""

from __future__ import annotations

import os
import time
from pathlib import Path

import numpy as np
import pytest

from airground.core.cloud import Source
from airground.io.recording import Recording
from sim.recording import recorder
from sim.recording.truth import Truth
from sim.robots.motion import ROBOTS, STEP_NS
from sim.scene.load import parse_scene
from sim.sensors.presets import PRESETS
from sim.world.world import build_world
from tests.hour.__main__ import failed, memory_table, pose_table
from tests.hour.laps import BEFORE_S, CLOSED_M, Laps, fly_laps
from tests.hour.recording import record_laps
from tests.hour.watched import STEAL_PERIOD_S, Poses, Watched, steal_clock
from tests.sim.small_flight import SCENE, unpainted

SMALL = parse_scene(SCENE, "small.toml")
LAPS_S = 50.0


@pytest.fixture(scope="module")
def laps() -> Laps:
    return fly_laps(build_world(SMALL, 0, pictures=False), SMALL, 1, LAPS_S)


def test_laps_repeat_after_the_first(laps: Laps) -> None:
    motion, lap_ns = laps.motion, round(laps.lap_s * 1e9)
    assert motion.duration_s == LAPS_S
    assert 2 * laps.lap_s < LAPS_S - BEFORE_S
    for robot in ROBOTS:
        states = motion.robot(robot)
        assert np.ptp(states.positions_world[:, 0]) > 0.5
        for stamp_ns in (round(BEFORE_S * 1e9), 13_234_567_890, 15_000_000_001):
            here, later = (motion.pose(robot, stamp_ns + k * lap_ns) for k in (0, 1))
            np.testing.assert_array_equal(here.matrix(), later.matrix())


def test_no_step_where_laps_join(laps: Laps) -> None:
    """Steps of the position are those of the velocity everywhere."""
    for robot in ROBOTS:
        states, step_s = laps.motion.robot(robot), STEP_NS * 1e-9
        mean = 0.5 * (states.velocities_world[1:] + states.velocities_world[:-1])
        off_m = np.abs(np.diff(states.positions_world, axis=0) - mean * step_s)
        assert off_m.max() < 0.1 * CLOSED_M


@pytest.mark.slow
def test_a_recording_of_laps_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "painted", unpainted)
    every = recorder.image_stamps

    def few(motion_stamps_ns: np.ndarray, first_ns: int) -> np.ndarray:
        """Every thirtieth image: one a second."""
        return every(motion_stamps_ns, first_ns)[::30]

    monkeypatch.setattr(recorder, "image_stamps", few)
    monkeypatch.setattr("tests.hour.recording.CAMERA_RATE_HZ", 1)
    monkeypatch.setattr("tests.hour.laps.UNIT_S", 1.0)
    out = tmp_path / "laps"
    lap_s = record_laps(SMALL, 0, PRESETS["nominal"], out, LAPS_S, 1)
    recording, truth = Recording.open(out), Truth.open(out)
    recording.verify()
    lap_ns, first_ns = round(lap_s * 1e9), round((BEFORE_S + 1) * 1e9)
    for robot in Source:
        sensed = recording.of(robot)
        stamps_ns = sensed.camera_stamps
        index = int(np.searchsorted(stamps_ns, first_ns))
        later = int(np.searchsorted(stamps_ns, stamps_ns[index] + lap_ns))
        assert stamps_ns[later] == stamps_ns[index] + lap_ns
        one, other = sensed.read_image(index), sensed.read_image(later)
        name = "image" if robot == Source.MAV else "colour"
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
        # Samples are measured anew: their noise does not repeat.
        assert sensed.imu is not None
        gyro = [sensed.imu.between(s, s + 10**9).gyro for s in (first_ns, first_ns + lap_ns)]
        off = np.abs(gyro[0] - gyro[1])
        assert 0 < np.median(off) < 0.02
    pose = truth.T_world_mav_camera(first_ns).matrix()
    np.testing.assert_array_equal(pose, truth.T_world_mav_camera(first_ns + lap_ns).matrix())
    files = list((out / "mav0/cam0/data").iterdir())
    assert len({os.stat(file).st_ino for file in files}) <= BEFORE_S + lap_s + 1 < len(files)


def test_what_is_beyond_a_limit_is_said() -> None:
    memory = [(60.0 * minute, 1000.0 + min(minute, 12)) for minute in range(61)]
    good = Watched(0, memory, 1300.0, "")
    at_s = np.array([1.0, 61.5])
    fine = Poses(np.array([20.0, 30.0]), at_s, 0, 0.001)
    assert failed(good, {"mav": fine}) == []
    assert good.growth_mib(600.0) == 2.0
    assert "| 50 | 1012 |" in memory_table(good, 3600.0)
    assert "| after the last image | 1300 |" in memory_table(good, 3600.0)
    stolen = [(60.9, 0.0), (61.1, 10.0), (61.9, 40.0), (62.1, 90.0)]
    grown = Watched(0, [*memory, (3601.0, 1061.0)], None, "", stolen)
    late = Poses(np.array([20.0, 101.0]), at_s, 3, 0.001)
    said = failed(grown, {"mav": fine, "ground": late})
    assert said == [
        "memory grew by 51 MiB after the tenth minute",
        "ground: 1 poses came later than 100 ms",
        "  101 ms at 61.50 s; the machine lost 30 ms around it",
        "ground: 3 images were dropped",
    ]
    assert "| ground | 60, 97, 101 | 1 | 3 | 0.10 |" in pose_table({"ground": late})


def test_stolen_time_is_read_while_a_command_runs() -> None:
    began_s = time.monotonic()
    with steal_clock() as readings:
        time.sleep(4 * STEAL_PERIOD_S)
    count, (at_s, stolen_ms) = len(readings), np.transpose(readings)
    assert count >= 2
    assert began_s < at_s[0] < at_s[-1] < time.monotonic()
    assert (np.diff(stolen_ms) >= 0).all()
    time.sleep(2 * STEAL_PERIOD_S)
    assert len(readings) == count


def test_a_short_flight_says_nothing_of_growth() -> None:
    assert Watched(0, [(60.0, 1000.0), (120.0, 1200.0)], None, "").growth_mib(600.0) is None


def test_the_motion_of_a_seed_is_the_same(laps: Laps) -> None:
    again = fly_laps(build_world(SMALL, 0, pictures=False), SMALL, 1, LAPS_S).motion
    np.testing.assert_array_equal(again.mav.positions_world, laps.motion.mav.positions_world)
