"""Sensors that fail do what their faults say, when they say so, and nothing else changes."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from airground.core.messages import ImuSamples, MagneticSamples
from airground.errors import InputError
from airground.io.recording import Recording
from sim.recording import recorder
from sim.recording.recorder import Flight, record, rendered
from sim.robots.carried import carried_back
from sim.robots.motion import RATE_HZ, Motion, simulate_motion
from sim.scene import parse_scene
from sim.sensors.faults import (
    SATURATED_ACCELEROMETER,
    SATURATED_GYRO,
    Fault,
    FaultKind,
    faulty_field,
    faulty_imu,
    placed,
)
from sim.sensors.faulty_frames import FaultyFrames
from sim.sensors.presets import NOMINAL
from sim.sensors.turned import with_clock_step, with_fault
from sim.world.world import build_world
from tests.sim.small_flight import SCENE, few_stamps, unpainted

SMALL = parse_scene(SCENE, "small.toml")
STAMPS = np.arange(100, dtype=np.int64) * 100_000_000
"""10 Hz for 10 s."""
INSIDE = (STAMPS >= 4_000_000_000) & (STAMPS < 6_000_000_000)


def fault(kind: FaultKind, robot: str = "ground", **size: float) -> Fault:
    """From 4 to 6 s."""
    return Fault(kind, robot, 2.0, 4.0, **size)  # type: ignore[arg-type]


def samples() -> ImuSamples:
    readings = np.random.default_rng(0).normal(0.0, 1.0, (2, len(STAMPS), 3))
    return ImuSamples(STAMPS, *readings)


def frames(*faults: Fault) -> FaultyFrames:
    return FaultyFrames.of(STAMPS, faults)


def test_starts_are_drawn_by_the_seed_or_stated() -> None:
    asked = [Fault("black", "mav", 1.0), Fault("black", "ground", 1.0, 7.5)]
    one, other, third = (placed(asked, 20.0, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert one == other != third
    assert [chosen.start_s for chosen in (one[1], third[1])] == [7.5, 7.5]
    assert 0.3 * 20 <= one[0].start_ns * 1e-9 <= 0.55 * 20


@pytest.mark.parametrize(
    ("make", "pattern"),
    [
        (lambda: Fault("blurred", "mav", 1.0), "unknown fault 'blurred'"),  # type: ignore[arg-type]
        (lambda: Fault("depth_gone", "mav", 1.0), "not of a robot 'mav'"),
        (lambda: Fault("black", "mav", -1.0), "duration_s must be at least 0, got -1"),
        (lambda: Fault("black", "mav", np.nan), "duration_s must be at least 0, got nan"),
        (lambda: _placed(Fault("black", "mav", 3.0, 8.0)), "lasts until 11 s"),
        (lambda: _placed(Fault("carried", "ground", 1.0, 4.0, 5.0)), "carried back by 5 s"),
    ],
)
def test_impossible_faults_are_refused(make, pattern: str) -> None:
    with pytest.raises(InputError, match=pattern):
        make()


def _placed(one: Fault) -> Sequence[Fault]:
    return placed([one], 10.0, np.random.default_rng(0))


def test_inertial_samples() -> None:
    whole = samples()
    silent = faulty_imu(whole, [fault("imu_silent")])
    np.testing.assert_array_equal(silent.gyro[INSIDE], 0.0)
    np.testing.assert_array_equal(silent.accelerometer[INSIDE], 0.0)
    saturated = faulty_imu(whole, [fault("imu_saturated")])
    np.testing.assert_allclose(np.abs(saturated.gyro[INSIDE]), SATURATED_GYRO)
    np.testing.assert_allclose(np.abs(saturated.accelerometer[INSIDE]), SATURATED_ACCELEROMETER)
    np.testing.assert_array_equal(np.sign(saturated.gyro), np.sign(whole.gyro))
    for faulty in (silent, saturated):
        np.testing.assert_array_equal(faulty.stamps_ns, STAMPS)
        np.testing.assert_array_equal(faulty.gyro[~INSIDE], whole.gyro[~INSIDE])
    gap = faulty_imu(whole, [fault("imu_gap")])
    np.testing.assert_array_equal(gap.stamps_ns, STAMPS[~INSIDE])
    np.testing.assert_array_equal(gap.accelerometer, whole.accelerometer[~INSIDE])


def test_images() -> None:
    rows = np.flatnonzero(INSIDE)
    image, depth = np.full((2, 3), 100, np.uint8), np.full((2, 3), 7, np.uint16)
    black = frames(fault("black"))
    assert [int(black.image(k, image).max()) for k in (39, 40, 59, 60)] == [100, 0, 0, 100]
    assert black.depth.all()
    bright = frames(fault("exposure", size=3.0))
    assert [int(bright.image(k, image).max()) for k in (39, 40, 60)] == [100, 255, 100]
    gone = frames(fault("depth_gone"))
    assert [int(gone.depth_units(k, depth).max()) for k in (39, 40, 59, 60)] == [7, 0, 0, 7]
    np.testing.assert_array_equal(frames(fault("frozen")).taken[rows], 39)
    repeated = frames(fault("repeated")).taken[rows]
    np.testing.assert_array_equal(repeated, np.repeat(rows[::2], 2))
    dropped = frames(fault("dropped"))
    np.testing.assert_array_equal(dropped.stamps_ns, STAMPS[~INSIDE])
    np.testing.assert_array_equal(dropped.taken, np.flatnonzero(~INSIDE))
    for faulty in (black, bright, gone):
        np.testing.assert_array_equal(faulty.stamps_ns, STAMPS)
        np.testing.assert_array_equal(faulty.taken, np.arange(len(STAMPS)))


def test_a_clock_that_steps_moves_all_stamps_of_the_robot() -> None:
    step = [fault("clock", size=1.5)]
    said = STAMPS + 1_500_000_000 * (STAMPS >= 4_000_000_000)
    said = said[said <= STAMPS[-1]]
    np.testing.assert_array_equal(faulty_imu(samples(), step).stamps_ns, said)
    field = MagneticSamples(STAMPS, np.ones((len(STAMPS), 3)))
    np.testing.assert_array_equal(faulty_field(field, step).stamps_ns, said)
    stepped = frames(*step)
    np.testing.assert_array_equal(stepped.stamps_ns, said)
    np.testing.assert_array_equal(stepped.taken, np.arange(len(said)))


@pytest.fixture(scope="module")
def motion() -> Motion:
    return simulate_motion(build_world(SMALL, 3, pictures=False), SMALL, 1)


def test_a_carried_robot_goes_on_from_where_it_was_before(motion: Motion) -> None:
    start, end, back = 600, 700, 400
    carried = carried_back(motion.ground, start, end, back, 1 / RATE_HZ)
    for name in ("positions_world", "rotations_world", "velocities_world", "gyro_imu"):
        whole, faulty = getattr(motion.ground, name), getattr(carried, name)
        np.testing.assert_array_equal(faulty[:start], whole[:start])
        left = len(whole) - end - 1
        again = slice(start - back + 1, start - back + 1 + left)
        np.testing.assert_array_equal(faulty[end + 1 :], whole[again])
    np.testing.assert_allclose(
        carried.positions_world[end], motion.ground.positions_world[start - back], atol=1e-9
    )
    steps = np.linalg.norm(np.diff(carried.positions_world, axis=0), axis=1)
    moved = np.linalg.norm(carried.positions_world[end] - carried.positions_world[start])
    assert moved > 0.1
    assert steps.max() < 0.01  # no leap: 2 m/s


@pytest.fixture(scope="module", autouse=True)
def _small_recordings() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", few_stamps)
        patch.setattr(recorder, "painted", unpainted)
        yield


FAULTS = (
    Fault("black", "mav", 1.0, 2.0),
    Fault("depth_gone", "ground", 1.0, 2.0),
    Fault("imu_gap", "mav", 1.0),
)


def test_a_recording_differs_by_its_faults_alone(tmp_path: Path) -> None:
    """Images are near 0.05, 2.5 and 5 s: the middle ones fail."""
    preset = replace(NOMINAL, faults=FAULTS)
    good, bad = (
        Recording.open(record(SMALL, 3, sensors, tmp_path / name, workers=1))
        for name, sensors in (("good", NOMINAL), ("bad", preset))
    )
    for index in range(3):
        one, other = good.mav.read_image(index), bad.mav.read_image(index)
        assert (one.image == other.image).all() == (index != 1)
        whole, faulty = good.ground.read_image(index), bad.ground.read_image(index)
        np.testing.assert_array_equal(whole.colour, faulty.colour)
        assert np.array_equal(whole.depth, faulty.depth, equal_nan=True) == (index != 1)
    assert not bad.mav.read_image(1).image.any()
    assert np.isnan(bad.ground.read_image(1).depth).all()
    assert good.mav.imu is not None
    assert bad.mav.imu is not None
    assert len(good.mav.imu.stamps_ns) - len(bad.mav.imu.stamps_ns) == RATE_HZ
    with rendered(Flight(SMALL, 3, 0, preset), workers=1) as drawn:
        assert not drawn.mav.read_image(1).image.any()
        assert np.isnan(drawn.ground.read_image(1).depth).all()
    rows = (tmp_path / "bad" / "truth" / "faults.csv").read_text().splitlines()
    assert rows[0] == "kind,robot,start [s],end [s],size"
    assert rows[1] == "black,mav,2.000000000,3.000000000,0.000000000"
    start, end = map(float, rows[3].split(",")[2:4])
    assert end - start == pytest.approx(1.0)
    assert np.diff(bad.mav.imu.stamps_ns).max() * 1e-9 == pytest.approx(1.005)
    assert not (tmp_path / "good" / "truth" / "faults.csv").exists()


def test_faults_must_leave_an_image(tmp_path: Path) -> None:
    preset = replace(NOMINAL, faults=(Fault("dropped", "mav", 5.0, 0.0),))
    with pytest.raises(InputError, match="small: no image of the mav is left"):
        record(SMALL, 3, preset, tmp_path / "out", workers=1)
    assert list(tmp_path.iterdir()) == []


def test_dials_add_a_fault_of_each_robot_that_can_have_it() -> None:
    assert with_fault(NOMINAL, "dropped", 0.0) == with_clock_step(NOMINAL, 0.0) == NOMINAL
    every = with_fault(with_fault(NOMINAL, "dropped", 2.0), "depth_gone", 0.5)
    every = with_clock_step(every, 0.4)
    named = [(one.kind, one.robot, one.duration_s, one.strength) for one in every.faults]
    assert named == [
        ("dropped", "mav", 2.0, 0.0),
        ("dropped", "ground", 2.0, 0.0),
        ("depth_gone", "ground", 0.5, 0.0),
        ("clock", "mav", 0.0, 0.4),
    ]
    assert {one.start_s for one in every.faults} == {None}
