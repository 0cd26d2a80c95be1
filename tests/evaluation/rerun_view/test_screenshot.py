"""Rerun's real viewer opens a run: it draws every panel, and complains of nothing."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rerun.experimental import ViewerClient

from airground.errors import AirgroundError
from evaluation.rerun_view import viewer
from tests.evaluation.rerun_view.scripted_run import written

WIDTH, HEIGHT = 1280, 800
PATIENCE_S = 60.0
HARMLESS = ("rasterizer",)
"""Warnings of a machine that draws without a graphics card."""


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[ViewerClient]:
    """The viewer with the scripted run in it, drawing without a screen."""
    file = written(tmp_path / "run.rrd")
    ports = viewer.free_ports()
    options = (str(file), "--headless", "--window-size", f"{WIDTH}x{HEIGHT}")
    try:
        with viewer.window(ports, *options) as process:
            try:
                yield connected(ports)
            finally:
                process.terminate()
                process.wait()
    except AirgroundError as error:
        pytest.skip(f"rerun's viewer cannot draw here (mesa-vulkan-drivers?): {error}")


def connected(ports: viewer.Ports) -> ViewerClient:
    """Once it has loaded the file."""
    client = ViewerClient.connect(ports.sink)
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        try:
            client.set_time("sensor_time", duration=3.9, play_state="paused")
            return client
        except Exception:  # not loaded yet: the client has no narrower error
            time.sleep(0.3)
    raise AssertionError("the viewer did not load the run")


@pytest.mark.slow
def test_the_viewer_draws_every_panel(opened: ViewerClient, tmp_path: Path) -> None:
    file = tmp_path / "view.png"
    until = time.monotonic() + PATIENCE_S
    while True:
        opened.save_screenshot(str(file))
        drawn = np.asarray(Image.open(file).convert("RGB")).astype(int)
        if red_share(drawn) > 0.004 or time.monotonic() > until:
            break
        time.sleep(0.5)
    assert drawn.shape == (HEIGHT, WIDTH, 3)
    # The ground robot's image, which is red, on the right; costs from dark to light below it.
    assert red_share(drawn[:, WIDTH // 2 :]) > 0.008
    below = drawn[HEIGHT // 2 : 3 * HEIGHT // 4, 4 * WIDTH // 5 :].mean(axis=2)
    assert np.ptp(below) > 120
    # Curves along the lower edge, in more than one colour.
    plots = drawn[4 * HEIGHT // 5 :].reshape(-1, 3)
    vivid = plots[np.ptp(plots, axis=1) > 80]
    assert len(np.unique(vivid // 64, axis=0)) >= 3
    complaints = [
        entry.message
        for entry in opened.get_logs()
        if entry.level in ("WARN", "ERROR") and not any(w in entry.message for w in HARMLESS)
    ]
    assert complaints == []


def red_share(picture: np.ndarray) -> float:
    """Share of the pixels that have the colour of the ground robot's image."""
    return float((np.abs(picture - (200, 40, 40)).max(axis=-1) < 12).mean())
