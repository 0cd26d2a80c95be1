"""The examples of docs/add_a_sensor.md do what the page says."""

from __future__ import annotations

import re
import runpy
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airground.io.recording import Recording
from sim.recording import recorder
from sim.recording.recorder import record
from sim.recording.truth import Truth
from sim.scene import parse_scene
from sim.sensors.presets import NONE
from tests.sim.small_flight import SCENE, few_stamps, unpainted

PAGE = Path(__file__).parents[2] / "docs" / "add_a_sensor.md"
EXAMPLES = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
PRESET, SLOW, FAILING, RANGEFINDER = EXAMPLES


@pytest.fixture(autouse=True)
def _few_images_without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "image_stamps", few_stamps)
    monkeypatch.setattr(recorder, "painted", unpainted)


def names_after(example: str, folder: Path) -> dict[str, Any]:
    """What an example leaves."""
    script = folder / "example.py"
    script.write_text(example, encoding="utf-8")
    return runpy.run_path(str(script))


@pytest.mark.slow
@pytest.mark.subject("docs/add_a_sensor.md", "sim", "airground/core", "airground/io")
def test_a_recording_is_made_with_the_preset(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    slow = names_after(PRESET + SLOW + FAILING, tmp_path)["SLOW"]
    assert (slow.exposure.damping, slow.exposure.frequency_hz) == (1.0, 0.3)
    recording, truth = Recording.open("recordings/home"), Truth.open("recordings/home")
    recording.verify()
    faults = Path("recordings/failing/truth/faults.csv").read_text().splitlines()
    assert [row.split(",")[0] for row in faults] == ["kind", "black", "imu_gap"]
    assert recording.sensors == "home"
    nominal, true = recording.mav.calibration.camera, truth.lens("mav").pinhole()
    assert abs(nominal.fx / true.fx - 1) == pytest.approx(2e-3)
    assert abs(truth.sensors("mav").camera.time_offset_ns) == 2_000_000


def test_the_rangefinder_measures_down_to_what_is_there(tmp_path: Path) -> None:
    made = record(parse_scene(SCENE, "small.toml"), 3, NONE, tmp_path / "made", workers=1)
    names = names_after(RANGEFINDER, tmp_path)
    truth, rng = Truth.open(made), np.random.default_rng(0)
    heights = truth.motion.mav.positions_world[:, 2]
    exact = names["measure_range"](truth.motion.mav, truth, 0.0, rng)
    assert exact[0] == pytest.approx(heights[0], abs=1e-3)  # level, on the floor
    assert exact[-1] > 1.0
    noisy = names["measure_range"](truth.motion.mav, truth, 0.02, rng)
    assert np.std(noisy - exact) == pytest.approx(0.02, rel=0.1)


def test_its_file_is_part_of_the_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_range = names_after(RANGEFINDER, tmp_path)["write_range"]
    write_truth = recorder.write_truth

    def with_range(root: Path, *what: Any) -> None:
        write_truth(root, *what)
        write_range(root, 0.02, np.random.default_rng(1))

    monkeypatch.setattr(recorder, "write_truth", with_range)
    made = record(parse_scene(SCENE, "small.toml"), 3, NONE, tmp_path / "made", workers=1)
    file = "mav0/range0/data.csv"
    rows = np.loadtxt(made / file, delimiter=",")
    assert np.diff(rows[:, 0]).tolist() == [20_000_000] * (len(rows) - 1)
    assert file in tomllib.loads((made / "recording.toml").read_text(encoding="utf-8"))["digests"]
    Recording.open(made).verify()
