"""One small recording with pictures, made once, and each of its exports."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from evaluation.datasets.formats import FORMATS, robots_for
from evaluation.datasets.simulated import Simulated
from sim.recording import recorder
from sim.recording.recorder import record
from sim.scene import parse_scene
from sim.sensors.presets import NOMINAL
from tests.sim.small_flight import SCENE

FIRST_NS, IMAGES = 3_300_000_000, 21


def images_in_flight(motion_stamps_ns: np.ndarray, first_ns: int) -> np.ndarray:
    """Less than a second at 30 Hz, over and beside the boxes."""
    return FIRST_NS + first_ns + np.rint(np.arange(IMAGES) * (1e9 / 30)).astype(np.int64)


@pytest.fixture(scope="session")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording with nominal sensors, shared by all tests: read only."""
    out = tmp_path_factory.mktemp("small") / "recording"
    scene = parse_scene(SCENE, "small.toml")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", images_in_flight)
        return record(scene, 3, NOMINAL, out, workers=1)


@pytest.fixture(scope="session")
def simulated(small: Path) -> Simulated:
    return Simulated.open(small)


@pytest.fixture(scope="session")
def exported(
    simulated: Simulated, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], Path]:
    """The folder of a format, made when first asked for."""
    made: dict[str, Path] = {}

    def folder(name: str) -> Path:
        if name not in made:
            made[name] = tmp_path_factory.mktemp(name)
            FORMATS[name].write(made[name], simulated, robots_for(name, None))
        return made[name]

    return folder
