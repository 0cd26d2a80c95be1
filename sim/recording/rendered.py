"""A flight as a recording whose images are drawn while they are read, and never stored."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airground.errors import AirgroundError
from airground.io import recording_writer
from airground.io.header import Header
from airground.io.images import metric_depth
from airground.io.recording import Recording
from sim.recording.frame_pool import FrameServer
from sim.recording.frames import FramePlan
from sim.recording.recorder import store_model, write_all_but_images
from sim.scene import Scene
from sim.sensors.presets import SensorPreset


@dataclass(frozen=True)
class Flight:
    """What a recording is made from.

    Attributes:
        scene: The scene of the world.
        seed: Decides the heap and, with `flight`, motion and noise.
        flight: Number of the flight over the same heap.
        sensors: Quality of the sensors.
        duration_s: Cuts the flight short; the scene's own length if None.
    """

    scene: Scene
    seed: int
    flight: int
    sensors: SensorPreset
    duration_s: float | None = None


@dataclass(frozen=True)
class _DrawnImages:
    """The images as they would be read from disk, where PNG loses nothing."""

    frames: FrameServer
    depth_units_per_m: float

    def mav(self, index: int) -> NDArray[np.uint8]:
        return self.frames.mav(index)

    def ground(self, index: int) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        colour, depth_units = self.frames.ground(index)
        return colour, metric_depth(depth_units, self.depth_units_per_m)


@contextmanager
def rendered(flight: Flight, workers: int) -> Iterator[Recording]:
    """The recording that `record` would make, message by message the same.

    Its folder, with samples and truth but without images, lasts as long as the context.

    Args:
        flight: Flight to simulate.
        workers: Number of processes that draw; they stay a few frames ahead of the reader.

    Raises:
        AirgroundError: One line on what was wrong.
    """
    with tempfile.TemporaryDirectory(prefix="airground-") as folder:
        plan, header = _prepare(Path(folder), flight)
        with FrameServer(plan, workers) as frames:
            depth_units_per_m = header.calibration.ground.depth.units_per_m
            yield Recording.open(folder, _DrawnImages(frames, depth_units_per_m))


def _prepare(root: Path, flight: Flight) -> tuple[FramePlan, Header]:
    """Write all but the images, and the world to draw them from."""
    what = flight.scene, flight.seed, flight.flight, flight.sensors
    try:
        header, plan = write_all_but_images(root, *what, flight.duration_s)
        recording_writer.finish(root, header, {})
        store_model(plan, flight.scene, flight.seed)
    except OSError as error:
        raise AirgroundError(f"{root}: the flight cannot be prepared there: {error}") from None
    return plan, header
