"""A recording is whole or absent, the same for the same seed, and its truth fits it."""

import errno
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from airground.core.messages import GroundImage, MavImage
from airground.errors import AirgroundError, InputError, RecordingError
from airground.io.digests import path_digest
from airground.io.recording import Recording
from airground.io.tum import read_tum
from sim.recording import frame_pool, recorder
from sim.recording.frames import FrameMaker
from sim.recording.recorder import image_stamps, record
from sim.recording.truth import Truth
from sim.robots.motion import ROBOTS
from sim.scene import parse_scene
from sim.sensors.presets import NOMINAL, NONE, REAL, SensorPreset
from sim.world.world import painted
from tests.sim.small_flight import FRAMES, SCENE, few_stamps, unpainted


@pytest.fixture(scope="module", autouse=True)
def _small_recordings() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", few_stamps)
        patch.setattr(recorder, "painted", unpainted)
        yield


def make(out: Path, preset: SensorPreset = NOMINAL, workers: int = 1, **options: int) -> Path:
    scene = parse_scene(SCENE, "small.toml")
    return record(scene, options.pop("seed", 3), preset, out, workers=workers, **options)


@pytest.fixture(scope="module")
def nominal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("nominal") / "recording")


@pytest.fixture(scope="module")
def perfect(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("none") / "recording", NONE)


def contents(folder: Path) -> dict[str, str]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path_digest(path) for path in files}


def test_the_reader_finds_what_was_recorded(nominal: Path) -> None:
    recording = Recording.open(nominal)
    recording.verify()
    assert (recording.scene, recording.seed, recording.sensors) == ("small", 3, "nominal")
    assert recording.duration_s == pytest.approx(5.0)
    images = [m.message for m in recording.messages()]
    assert sum(isinstance(m, MavImage) for m in images) == FRAMES
    assert sum(isinstance(m, GroundImage) for m in images) == FRAMES
    assert recording.mav.read_image(0).image.shape == (480, 752)
    assert recording.ground.read_image(0).colour.shape == (480, 640, 3)
    assert not (nominal / "world.mjb").exists()
    assert [path.name for path in nominal.parent.iterdir()] == ["recording"]


def test_the_truth_is_that_of_the_images(perfect: Path) -> None:
    """Depth by ray casting the true mesh from the true pose is what a perfect camera saw."""
    recording, truth = Recording.open(perfect), Truth.open(perfect)
    for image in map(recording.ground.read_image, range(len(recording.ground.camera_stamps))):
        true = truth.depth("ground", image.stamp_ns)
        both = np.isfinite(true) & np.isfinite(image.depth)
        assert both.mean() > 0.5
        error = np.abs(true - image.depth)[both]
        assert np.median(error) < 2e-4  # half of a PNG unit is 1e-4
        assert np.quantile(error, 0.995) < 2e-3


def test_the_clock_offset_moves_the_truth(nominal: Path) -> None:
    truth, recording = Truth.open(nominal), Recording.open(nominal)
    stamp = int(recording.mav.camera_stamps[1])
    offset = truth.calibration.mav.camera.time_offset_ns
    assert abs(offset) == 1_000_000
    expected = truth.motion.camera_pose("mav", stamp + offset)
    np.testing.assert_array_equal(truth.T_world_mav_camera(stamp).matrix(), expected.matrix())
    assert recording.header.calibration.mav.camera.time_offset_ns == 0


def test_outside_of_its_motion_the_truth_has_no_pose(nominal: Path) -> None:
    truth = Truth.open(nominal)
    for robot in ROBOTS:
        said = rf"truth: no true pose of the {robot}: stamp -?\d+ is outside the motion \[0, 5\d+\]"
        for ask in (truth.T_world_camera, truth.row_poses, truth.depth):
            for stamp_ns in (-2_000_000, 5_002_000_000):
                with pytest.raises(RecordingError, match=said):
                    ask(robot, stamp_ns)


def test_trajectories_are_those_of_the_motion(nominal: Path) -> None:
    truth = Truth.open(nominal)
    for robot in ("mav", "ground"):
        poses = read_tum(nominal / "truth" / f"{robot}.tum")
        np.testing.assert_array_equal(poses.stamps_ns, truth.motion.stamps_ns)
        states = truth.motion.robot(robot)
        np.testing.assert_allclose(poses.translations, states.positions_world, atol=1e-9)
        np.testing.assert_allclose(poses.rotations, states.rotations_world, atol=1e-8)


def test_distances_to_the_surface(perfect: Path) -> None:
    truth = Truth.open(perfect)
    points = np.array([[2.3, -2.3, 0.05], [2.3, 2.3, -0.2]])
    np.testing.assert_allclose(truth.surface("ground").distance(points), [0.05, 0.2], atol=1e-6)
    assert len((perfect / "truth" / "boxes.csv").read_text().splitlines()) == 3


def test_depth_errs_by_scale_and_noise_only(nominal: Path) -> None:
    recording, truth = Recording.open(nominal), Truth.open(nominal)
    nominal = recording.depth_units_per_m
    scale = truth.calibration.ground.depth.units_per_m / nominal
    assert abs(scale - 1) == pytest.approx(3e-3)
    ratios = []
    for image in map(recording.ground.read_image, range(len(recording.ground.camera_stamps))):
        true = truth.depth("ground", image.stamp_ns)
        near = (true > 0.6) & (true < 3) & np.isfinite(image.depth)
        ratios.append((image.depth / true)[near])
    assert np.median(np.concatenate(ratios)) == pytest.approx(scale, abs=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize("preset", [NOMINAL, REAL], ids=lambda preset: preset.name)
def test_the_same_seed_gives_the_same_bytes_whoever_renders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, preset: SensorPreset
) -> None:
    monkeypatch.setattr(recorder, "painted", painted)
    one, two, four = (
        contents(make(tmp_path / str(workers), preset, workers)) for workers in (1, 2, 4)
    )
    assert one == two == four


def test_another_flight_is_over_the_same_heap(nominal: Path, tmp_path: Path) -> None:
    first, other = contents(nominal), contents(make(tmp_path / "flight", flight=1))
    for name in ("truth/boxes.csv", "truth/surface.ply"):
        assert first[name] == other[name]
    moving = [n for n in first if n.endswith((".png", ".tum")) or "imu0/data" in n]
    assert len(moving) == 3 * FRAMES + 2 + 2
    for name in moving:
        assert first[name] != other[name], name


def test_an_existing_folder_is_refused(nominal: Path) -> None:
    with pytest.raises(InputError, match="already exists"):
        make(nominal)


@pytest.mark.parametrize(
    ("options", "pattern"),
    [({"workers": 0}, "workers"), ({"seed": -1}, "seed"), ({"flight": -1}, "flight")],
)
def test_impossible_numbers_are_refused(tmp_path: Path, options: dict, pattern: str) -> None:
    with pytest.raises(InputError, match=pattern):
        make(tmp_path / "out", **options)


def fail_after_one(error: BaseException):
    original = FrameMaker.make
    calls: Iterator[int] = iter(range(100))

    def make_frame(self, robot, index):
        if next(calls) == 1:
            raise error
        return original(self, robot, index)

    return make_frame


@pytest.mark.parametrize(
    ("error", "expected", "pattern"),
    [
        (KeyboardInterrupt(), KeyboardInterrupt, None),
        (OSError(errno.ENOSPC, "No space left on device"), AirgroundError, "disk is full"),
        (OSError(errno.EACCES, "Permission denied"), AirgroundError, "cannot be recorded"),
    ],
)
def test_half_a_recording_is_never_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error, expected, pattern
) -> None:
    monkeypatch.setattr(frame_pool.FrameMaker, "make", fail_after_one(error))
    with pytest.raises(expected, match=pattern):
        make(tmp_path / "out")
    assert list(tmp_path.iterdir()) == []


def test_too_short_a_flight_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="duration_s"):
        record(parse_scene(SCENE, "small.toml"), 0, NONE, tmp_path / "out", 0.5, 1)
    assert list(tmp_path.iterdir()) == []


def test_stamps_of_images() -> None:
    motion = np.arange(0, 2_000_000_001, 5_000_000)
    stamps = image_stamps(motion, 50_000_000)
    assert stamps[0] == 50_000_000
    assert stamps[30] == 1_050_000_000
    assert np.abs(np.diff(stamps) - 1e9 / 30).max() <= 1
    assert stamps[-1] <= 1_980_000_000 < stamps[-1] + 1e9 / 30


def test_no_truth_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(AirgroundError, match="no truth"):
        Truth.open(tmp_path)
