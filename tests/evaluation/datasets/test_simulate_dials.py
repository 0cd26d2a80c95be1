"""`simulate --dial`: what it says, what it refuses, and that the recording states it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from airground.errors import InputError
from airground.io.header import read_header
from airground.io.recording import Recording
from evaluation.cli import answer
from evaluation.measure.plans.dials import parse_dials
from tests.sim.small_flight import SCENE


def test_words_become_numbers() -> None:
    words = ["sensors.readout_ms=20", " scene.light = 0.5"]
    assert parse_dials(words) == {"sensors.readout_ms": 20.0, "scene.light": 0.5}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["sensors.readout_ms"], "expected NAME=VALUE; dials: scene.overlap"),
        (["localization.particles=50"], "expected NAME=VALUE"),
        (["sensors.zoom=2"], "unknown dial"),
        (["scene.light=dark"], "'dark' is no number"),
        (["scene.light=1", "scene.light=0"], "given twice"),
    ],
)
def test_wrong_words(words: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_dials(words)


def test_a_recording_states_its_dials(tmp_path: Path) -> None:
    short = SCENE.replace("takeoff_s = 1.6", "takeoff_s = 0.2").replace("= 5.0\n", "= 3.4\n", 1)
    (tmp_path / "small.toml").write_text(short)
    words = ["simulate", str(tmp_path / "small.toml"), "--sensors", "none"]
    words += ["--out", str(tmp_path / "out"), "--dial", "sensors.fisheye=1"]
    with pytest.raises(InputError, match="out of its range, 0 to 30 ms"):
        answer([*words, "--dial", "sensors.readout_ms=31"])
    with pytest.raises(InputError, match="no 30 Hz divided by a whole number"):
        answer([*words, "--dial", "sensors.camera_hz=20"])
    words += ["--dial", "sensors.camera_hz=10"]
    assert answer([*words, "--dial", "sensors.readout_ms=12"]) in (None, 0)
    header = read_header(tmp_path / "out" / "recording.toml")
    assert header.dials == {
        "sensors.fisheye": 1.0,
        "sensors.readout_ms": 12.0,
        "sensors.camera_hz": 10.0,
    }
    camera = header.calibration.mav.camera
    steps_ns = np.diff(Recording.open(tmp_path / "out").mav.camera_stamps)
    np.testing.assert_allclose(steps_ns, 1e8, atol=1)
    assert (camera.rate_hz, header.frames.mav) == (10.0, len(steps_ns) + 1)
    assert (camera.distortion_model, camera.readout_s) == ("equidistant", 0.012)
