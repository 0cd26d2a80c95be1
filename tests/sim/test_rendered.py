"""Images drawn while they are read are those that a recording would hold."""

import multiprocessing
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from airground.core.messages import Stamped
from airground.errors import AirgroundError, InputError
from airground.io.recording import Recording
from sim.recording import recorder
from sim.recording.recorder import Flight, record, rendered
from sim.recording.truth import Truth
from sim.scene import parse_scene
from sim.sensors.presets import NOMINAL
from tests.sim.small_flight import FRAMES, SCENE, few_stamps, unpainted

FLIGHT = Flight(parse_scene(SCENE, "small.toml"), 3, 1, NOMINAL)


@pytest.fixture(scope="module", autouse=True)
def _small_recordings() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", few_stamps)
        patch.setattr(recorder, "painted", unpainted)
        yield


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("stored") / "recording"
    return record(FLIGHT.scene, FLIGHT.seed, FLIGHT.sensors, out, workers=1, flight=FLIGHT.flight)


def assert_same(one: Stamped, other: Stamped) -> None:
    assert one.robot == other.robot
    assert type(one.message) is type(other.message)
    for field in fields(one.message):
        a, b = (getattr(stamped.message, field.name) for stamped in (one, other))
        np.testing.assert_array_equal(a, b)
        assert np.asarray(a).dtype == np.asarray(b).dtype


def test_all_is_as_if_recorded_and_read(stored: Path) -> None:
    recording, truth = Recording.open(stored), Truth.open(stored)
    with rendered(FLIGHT, workers=2) as drawn:
        messages = list(recording.messages())
        assert len(messages) == 2 * 3 * FRAMES
        for one, other in zip(messages, drawn.messages(), strict=True):
            assert_same(one, other)
        nominal = recording.header.model_dump(exclude={"digests"})
        assert drawn.header.model_dump(exclude={"digests"}) == nominal
        drawn_truth = Truth.open(drawn.path)
        stamp = int(recording.ground.camera_stamps[1])
        np.testing.assert_array_equal(
            drawn_truth.depth("ground", stamp), truth.depth("ground", stamp)
        )
        assert not list(drawn.path.rglob("*.png"))
        for index in (2, 0, 0, 1):  # any order is served
            image = recording.ground.read_image(index)
            np.testing.assert_array_equal(drawn.ground.read_image(index).depth, image.depth)
    assert not drawn.path.exists()
    assert not multiprocessing.active_children()


def read_all(recording: Recording) -> None:
    for _ in recording.messages():
        pass


def test_a_dead_process_is_reported() -> None:
    with rendered(FLIGHT, workers=1) as drawn:
        for child in multiprocessing.active_children():
            child.kill()
        with pytest.raises(AirgroundError, match="rendering process died"):
            read_all(drawn)
    assert not drawn.path.exists()


def test_an_impossible_flight_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    short = FLIGHT.scene.model_copy(update={"duration_s": 0.5})
    with pytest.raises(InputError, match="duration_s"), rendered(Flight(short, 3, 1, NOMINAL), 1):
        pass
    assert list(tmp_path.iterdir()) == []
