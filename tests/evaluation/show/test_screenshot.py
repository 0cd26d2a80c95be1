"""Rerun's real viewer opens a run: it draws every panel, and complains of nothing."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from PIL import Image
from rerun.experimental import ViewerClient

from airground.errors import AirgroundError
from evaluation.show.rerun_view import viewer
from evaluation.show.rerun_view.run_view import RunView
from tests.evaluation.show.scripted_run import (
    CONFIG,
    LENSES,
    NAME,
    TIMES_NS,
    TRUTH,
    seen_events,
    show,
    written,
)

WIDTH, HEIGHT = 1280, 800
Answer = TypeVar("Answer")
PANELS = 16
PATIENCE_S = 120.0
HARMLESS = ("rasterizer",)
"""Warnings of a machine that draws without a graphics card."""


@contextmanager
def headless(ports: viewer.Ports, *files: str) -> Iterator[ViewerClient]:
    """The viewer, drawing without a screen."""
    options = (*files, "--headless", "--window-size", f"{WIDTH}x{HEIGHT}")
    try:
        with viewer.window(ports, *options) as process:
            try:
                yield ViewerClient.connect(ports.sink)
            except ConnectionError:
                if process.poll() is None:
                    raise
                # On a busy machine it ends only after it has opened its ports.
                pytest.skip(f"rerun's viewer ended with exit code {process.returncode}")
            finally:
                process.terminate()
                process.wait()
    except AirgroundError as error:
        pytest.skip(f"rerun's viewer cannot draw here: {error}")


def patiently(ask: Callable[[], Answer]) -> Answer:
    """What a viewer answers in the end: it may be loading, or slow without a graphics card."""
    until = time.monotonic() + PATIENCE_S
    while True:
        try:
            return ask()
        except Exception:  # the client has no narrower error
            if time.monotonic() > until:
                raise
            time.sleep(0.3)


def wait_for_the_run(client: ViewerClient) -> None:
    """Until it is there; then stay at a time when everything is."""
    patiently(lambda: client.set_time("sensor_time", duration=3.9, play_state="paused"))


@pytest.mark.slow
def test_the_viewer_draws_every_panel(tmp_path: Path) -> None:
    file = written(tmp_path / "run.rrd")
    with headless(viewer.free_ports(), str(file)) as opened:
        wait_for_the_run(opened)
        drawn = settled(opened, tmp_path / "view.png")
        views = patiently(opened.get_state).views
        logged = patiently(opened.get_logs)
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
        for entry in logged
        if entry.level in ("WARN", "ERROR") and not any(w in entry.message for w in HARMLESS)
    ]
    assert complaints == []
    assert len(views) == PANELS
    assert [view.reports for view in views if view.reports] == []


@pytest.mark.slow
def test_a_run_is_seen_while_it_happens(tmp_path: Path) -> None:
    ports = viewer.free_ports()
    with headless(ports) as opened:
        view = RunView(
            tmp_path / "run.rrd", NAME, LENSES, TRUTH, CONFIG, TIMES_NS, "all", ports.sink
        )
        show(view, seen_events())
        view.close()
        wait_for_the_run(opened)
        drawn = settled(opened, tmp_path / "view.png")
    assert red_share(drawn[:, WIDTH // 2 :]) > 0.008


def settled(client: ViewerClient, file: Path) -> np.ndarray:
    """(height, width, 3) what the viewer shows, once images are there or patience ends."""
    until = time.monotonic() + PATIENCE_S
    while True:
        patiently(lambda: client.save_screenshot(str(file)))
        drawn = np.asarray(Image.open(file).convert("RGB")).astype(int)
        if red_share(drawn) > 0.004 or time.monotonic() > until:
            return drawn
        time.sleep(0.5)


def red_share(picture: np.ndarray) -> float:
    """Share of the pixels that have the colour of the ground robot's image."""
    return float((np.abs(picture - (200, 40, 40)).max(axis=-1) < 12).mean())
