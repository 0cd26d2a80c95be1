"""Automatic exposure sees the light that each robot sees, whoever draws the images."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from airground.errors import RecordingError
from airground.io.digests import path_digest
from airground.io.lens import Lens
from airground.io.recording import Recording
from evaluation.datasets.inspection.exposure import look_at_exposure
from evaluation.datasets.inspection.findings import Finding, Verdict
from sim.recording import recorder
from sim.recording.exposure_truth import read_exposure
from sim.recording.light_meter import EVERY, WIDTH_PX, meter_camera
from sim.recording.recorder import Flight, record, rendered
from sim.scene import Scene, parse_scene
from sim.sensors.auto_exposure import CONSUMER_EXPOSURE
from sim.sensors.faults import Fault
from sim.sensors.presets import NOMINAL, SensorPreset
from sim.world.world import painted
from tests.sim.small_flight import FRAMES, SCENE, few_stamps, unpainted

SMALL = parse_scene(SCENE, "small.toml")
AUTO = replace(NOMINAL, exposure=CONSUMER_EXPOSURE)


@pytest.fixture(scope="module", autouse=True)
def _small_recordings() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", few_stamps)
        patch.setattr(recorder, "painted", unpainted)
        yield


def make(out: Path, scene: Scene = SMALL, preset: SensorPreset = AUTO, workers: int = 1) -> Path:
    return record(scene, 3, preset, out, workers=workers)


@pytest.fixture(scope="module")
def automatic(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make(tmp_path_factory.mktemp("automatic") / "recording")


def contents(folder: Path) -> dict[str, str]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path.relative_to(folder)): path_digest(path) for path in files}


def test_the_meter_looks_where_the_camera_looks() -> None:
    lens = Lens(640, 480, (525.0, 525.0, 319.5, 239.5), ())
    camera = meter_camera(lens)
    assert (camera.width, camera.height) == (WIDTH_PX, 60)
    assert camera.fx == pytest.approx(525 / 8)
    wide = meter_camera(replace(lens, intrinsics=(200.0, 200.0, 319.5, 239.5)))
    assert np.rad2deg(np.arctan(WIDTH_PX / 2 / wide.fx)) == pytest.approx(50.2, abs=0.1)


def test_every_image_has_its_exposure(automatic: Path) -> None:
    exposures, recording = read_exposure(automatic), Recording.open(automatic)
    assert exposures is not None
    for robot, images in (("mav", recording.mav), ("ground", recording.ground)):
        one = exposures[robot]  # type: ignore[index]
        np.testing.assert_array_equal(one.stamps_ns, images.camera_stamps)
        assert len(one.exposure_s) == FRAMES
        assert look_at_exposure(robot, images)[0].verdict is Verdict.FINE
    assert "exposure" not in (automatic / "recording.toml").read_text()


@pytest.mark.slow
def test_the_same_bytes_from_any_number_of_workers(automatic: Path, tmp_path: Path) -> None:
    assert contents(make(tmp_path / "again", workers=2)) == contents(automatic)


def test_images_that_are_drawn_as_they_are_read_are_the_same(automatic: Path) -> None:
    stored = Recording.open(automatic)
    with rendered(Flight(SMALL, 3, 0, AUTO), workers=1) as drawn:
        for index in range(FRAMES):
            one, other = stored.mav.read_image(index), drawn.mav.read_image(index)
            np.testing.assert_array_equal(one.image, other.image)
        table = "truth/exposure.csv"
        assert (drawn.path / table).read_bytes() == (automatic / table).read_bytes()


@pytest.mark.slow
def test_a_darker_flight_is_exposed_longer_and_looks_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Display values of a quarter of the light are 0.53 times as large."""
    monkeypatch.setattr(recorder, "painted", painted)
    light = SMALL.light
    quarter = {name: getattr(light, name) / 4 for name in ("main", "fill", "ambient")}
    dark = SMALL.model_copy(update={"flight_light": light.model_copy(update=quarter)})
    made = {
        "bright": make(tmp_path / "bright"),
        "dark": make(tmp_path / "dark", dark),
        "fixed": make(tmp_path / "fixed", dark, NOMINAL),
    }
    means = {name: Recording.open(p).mav.read_image(1).image.mean() for name, p in made.items()}
    exposures = {name: read_exposure(path) for name, path in made.items()}
    before, after = exposures["bright"], exposures["dark"]
    assert before is not None
    assert after is not None
    assert exposures["fixed"] is None
    ratio = after["mav"].exposure_s * after["mav"].gain / before["mav"].exposure_s
    assert ratio == pytest.approx(1 / 0.53, rel=0.1)
    np.testing.assert_array_equal(after["ground"].exposure_s, before["ground"].exposure_s)
    assert means["dark"] == pytest.approx(means["bright"], rel=0.05)
    assert means["fixed"] < 0.7 * means["bright"]


def test_a_fault_of_exposure_comes_on_top(automatic: Path, tmp_path: Path) -> None:
    """The camera does not know of it; images that are dropped have no exposure."""
    faults = (Fault("exposure", "mav", 1.0, 2.0, 0.5), Fault("dropped", "ground", 1.0, 2.0))
    out = make(tmp_path / "faulty", SMALL, replace(AUTO, faults=faults))
    before, after = read_exposure(automatic), read_exposure(out)
    assert before is not None
    assert after is not None
    np.testing.assert_array_equal(after["mav"].exposure_s, before["mav"].exposure_s)
    np.testing.assert_array_equal(after["ground"].exposure_s, before["ground"].exposure_s[[0, 2]])
    whole, half = (Recording.open(path).mav.read_image(1).image for path in (automatic, out))
    np.testing.assert_array_equal(half, np.rint(0.5 * whole))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("robot,", "robots,"), "1: must be the columns"),
        (("mav,", "bird,"), "2: must be mav or ground"),
        ((",1.000000", ",0.500000"), "2: must be mav or ground"),
    ],
)
def test_damage_is_named(
    automatic: Path, tmp_path: Path, change: tuple[str, str], message: str
) -> None:
    text = (automatic / "truth/exposure.csv").read_text()
    (tmp_path / "truth").mkdir()
    (tmp_path / "truth/exposure.csv").write_text(text.replace(*change))
    with pytest.raises(RecordingError, match=message):
        read_exposure(tmp_path)


def test_exposures_of_other_images_are_found(
    automatic: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    exposures = read_exposure(automatic)
    assert exposures is not None
    one = exposures["mav"]
    cut = replace(one, stamps_ns=one.stamps_ns[1:])
    monkeypatch.setattr(
        "evaluation.datasets.inspection.exposure.read_exposure", lambda _: {"mav": cut}
    )
    found = look_at_exposure("mav", Recording.open(automatic).mav)
    words = "its stamps are not those of the images: 1 are of one alone"
    assert found == [Finding("mav", "true exposure", words, Verdict.WRONG)]


def test_images_between_metered_ones_are_few() -> None:
    """What is metered is seen before it acts: the regulator is later than the interpolation."""
    assert CONSUMER_EXPOSURE.delay_frames >= EVERY - 1
