"""A run that opens at a moment of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from rerun.chunk import Chunk, RrdReader

from airground.errors import InputError
from evaluation.show.rerun_view.later_start import also_from
from evaluation.show.rerun_view.run_view import layout
from evaluation.show.rerun_view.sensor_stream import TIMELINE, SensorStream
from evaluation.show.rerun_view.trace import RunFile

FROM_MOMENT = "from_moment"
"""A timeline with the stamps of `sensor_time` that begins at the moment."""
EVERYTHING = ("+ /**", "- /__properties/**")


def write_from(file: RunFile, at_s: float, out: Path) -> None:
    """Write a copy of a run that a viewer opens, paused, at `at_s` of the sensors' clock [s].

    Raises:
        InputError: The run has nothing then.
    """
    stamps = np.concatenate([_stamps(chunk.to_record_batch()) for chunk in _chunks(file)])
    first, last = int(stamps.min()), int(stamps.max())
    # To the microsecond: a time may be typed as it is shown.
    if not first * 1e-9 - 1e-6 <= at_s <= last * 1e-9 + 1e-6:
        raise InputError(
            f"--at {at_s:g}: {file.path} has nothing then; expected seconds of the sensors, from "
            f"{first * 1e-9:.3f} to {last * 1e-9:.3f}"
        )
    at_ns = min(max(round(at_s * 1e9), first), last)
    shown = layout(file.has_truth, (first, last), opens=FROM_MOMENT)
    stream = SensorStream(out, file.recording, shown)
    stream.send(_with_clock(file, at_ns))
    stream.close()


def _with_clock(file: RunFile, at_ns: int) -> Iterator[Chunk]:
    for chunk in _chunks(file):
        for batch in also_from(at_ns, FROM_MOMENT, chunk.to_record_batch()):
            (changed,) = Chunk.from_record_batch(batch)
            yield changed.with_entity_path(chunk.entity_path)


def _chunks(file: RunFile) -> Iterator[Chunk]:
    yield from RrdReader(file.path).stream().filter(content=list(EVERYTHING))


def _stamps(batch: pa.RecordBatch) -> NDArray[np.int64]:
    if TIMELINE not in batch.schema.names:
        return np.zeros(0, np.int64)
    stamps: NDArray[np.int64] = batch.column(TIMELINE).cast(pa.int64()).to_numpy()
    return stamps
