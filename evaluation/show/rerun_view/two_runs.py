"""Two runs of one recording in one .rrd file, on one clock.

The second run's entities lie under `/second`, its frames have names of their own, and its ground
map lies on the first's: both start at the ground robot's first pose. The first run is drawn in
blue, the second in orange.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk, RrdReader

from airground.core.se3 import SE3
from evaluation.judge.divergence import Held, first_divergence
from evaluation.show.figures.scene_pictures import tinted
from evaluation.show.rerun_view.later_start import also_from
from evaluation.show.rerun_view.sensor_stream import (
    GROUND,
    TIMELINE,
    TRUTH,
    SensorStream,
    transform,
)
from evaluation.show.rerun_view.timeline import COLOURS
from evaluation.show.rerun_view.trace import SPREAD, RunFile
from evaluation.show.rerun_view.two_runs_layout import (
    DIFFERENCES,
    FROM_DIFFERENCE,
    MARKERS,
    SECOND,
    SECOND_FRAME,
    Colour,
    two_runs_layout,
)

FIRST_COLOUR: Colour = (70, 160, 255)
SECOND_COLOUR: Colour = (255, 150, 40)
RED: Colour = (255, 70, 70)
SHARED_TRUTH = ("+ /**", f"- {TRUTH}/mav/**", f"- {TRUTH}/ground/**", f"- {TRUTH}/world",
                f"- {TRUTH}/scene", "- /__properties/**")  # fmt: skip
"""What the second run adds: the truth is that of the first."""
FRAME_NAMES = ("Transform3D:child_frame", "Transform3D:parent_frame", "CoordinateFrame:frame",
               "Pinhole:child_frame", "Pinhole:parent_frame")  # fmt: skip
MARKER = rr.SeriesPoints(
    colors=[RED], markers="diamond", names=["first difference"], marker_sizes=[5]
)
GROUND_MAP = "/ground/map"
"""Grey in the first run, so that the paths and aerial maps of both are seen on it."""
CLOUDS = ("/mav/map", "/mav/surface", GROUND_MAP)
PATH_RADIUS = -2.0
"""Radius of paths, in points of the screen, which rerun has as negative numbers."""
PATH_SHADES = {"ground": -0.38, "mav": 0.0}
"""Shades of a robot's path and frustum."""
SHADES = (0.5, 0.0, -0.35)
"""Shades of the curves of a plot, in their order: the share of white, or less for black."""
SHIFTS, OPAQUE = np.array([24, 16, 8], np.uint32), np.uint32(0xFF)
"""Where rerun has red, green and blue in a colour of 32 bits, and its opacity."""
Colours = NDArray[np.uint8]


class Side(NamedTuple):
    """How one of both runs is drawn; `root` is "" for the first."""

    file: RunFile
    root: str
    colour: Colour


def write_both(first: RunFile, second: RunFile, helds: Sequence[Held], out: Path) -> None:
    """Write both runs to one file, with their first differences as markers."""
    sides = Side(first, "", FIRST_COLOUR), Side(second, SECOND, SECOND_COLOUR)
    earliest = first_divergence(helds)
    since_ns = None if earliest is None or earliest.first is None else earliest.first.stamp_ns
    layout = two_runs_layout(first, second, earliest)
    stream = SensorStream(out, f"{first.name}, {second.name}", layout)
    for side in sides:
        stream.send(_drawn(side, since_ns))
    identity = transform(SE3.identity(), GROUND, f"{SECOND_FRAME}{GROUND}")
    stream.log_always(f"{SECOND}/ground", identity)
    if since_ns is not None:
        stream.log_always(MARKERS, MARKER)
        stream.send(_marks(helds, since_ns))
    stream.close()


def _marks(helds: Sequence[Held], since_ns: int) -> Iterator[Chunk]:
    """A message at each first difference, and a point in the plots at the earliest."""
    parted = [(held, held.first) for held in helds if held.first is not None]
    texts = [
        f"{held.kind} differs: {first.how_much} (small: up to {held.small})"
        for held, first in parted
    ]
    messages = rr.TextLog.columns(text=texts, level=[rr.TextLogLevel.ERROR] * len(texts))
    yield _at([first.stamp_ns for _, first in parted], DIFFERENCES, messages)
    yield _at([since_ns], MARKERS, rr.Scalars.columns(scalars=[0.0]))


def _at(stamps_ns: list[int], entity: str, columns: rr.ComponentColumnList) -> Chunk:
    times = np.array(stamps_ns, "timedelta64[ns]")
    clocks = [rr.TimeColumn(name, duration=times) for name in (TIMELINE, FROM_DIFFERENCE)]
    return Chunk.from_columns(entity, clocks, columns)


def _drawn(side: Side, since_ns: int | None) -> Iterator[Chunk]:
    """The chunks of a run in its place and colour."""
    content = SHARED_TRUTH if side.root else ("+ /**", "- /__properties/**")
    for chunk in RrdReader(side.file.path).stream().filter(content=list(content)):
        batch = _changed(chunk, side)
        timed = [batch] if since_ns is None else also_from(since_ns, FROM_DIFFERENCE, batch)
        for rows in timed:
            (changed,) = Chunk.from_record_batch(rows)
            yield changed.with_entity_path(side.root + chunk.entity_path)


def _changed(chunk: Chunk, side: Side) -> pa.RecordBatch:
    """The rows of a chunk with the run's colour, its name, and its names of frames."""
    batch = chunk.to_record_batch()
    columns = [
        _changed_column(name, column, chunk.entity_path, side)
        for name, column in zip(batch.schema.names, batch.columns, strict=True)
    ]
    return pa.RecordBatch.from_arrays(columns, schema=batch.schema)


def _changed_column(name: str, column: pa.ListArray, entity: str, side: Side) -> pa.ListArray:
    match name:
        case "TextLog:text":
            return _with_words(column, lambda text: f"{side.file.name}: {text}")
        case "SeriesLines:names" if _is_alone(entity):
            return _with_words(column, lambda _: side.file.name)
        case "SeriesLines:names":
            return _with_words(column, lambda name: f"{side.file.name}: {name}")
        case "SeriesLines:colors":
            return _repainted(column, lambda old: _shades(old, side.colour, _is_alone(entity)))
        case "LineStrips3D:colors" | "Pinhole:color" if not entity.startswith(TRUTH):
            shade = _shaded(side.colour, PATH_SHADES[entity.split("/")[1]])
            return _repainted(column, lambda old: np.tile(shade, (len(old), 1)))
        case "LineStrips3D:radii" if not entity.startswith(TRUTH):
            return _with_values(
                column, pa.array([PATH_RADIUS] * len(column.flatten()), pa.float32())
            )
        case "Points3D:colors" if entity in CLOUDS:
            tint = None if entity == GROUND_MAP and not side.root else side.colour
            return _repainted(column, lambda old: tinted(old, tint))
        case _ if name in FRAME_NAMES and side.root:
            return _with_words(column, lambda frame: SECOND_FRAME + frame)
    return column


def _shades(old: Colours, colour: Colour, alone: bool) -> Colours:
    """Shades of one colour, by the place of each curve in its plot; the colour if it is alone."""
    known = [] if alone else [tuple(one) for one in old.tolist()]
    shades = [SHADES[COLOURS.index(one) % len(SHADES)] for one in known if one in COLOURS]
    return np.array([_shaded(colour, shade) for shade in shades or [0.0] * len(old)])


def _shaded(colour: Colour, white: float) -> Colours:
    """A colour mixed with a share of white, or of black if less than 0."""
    other = 255.0 if white > 0 else 0.0
    return np.rint((1 - abs(white)) * np.array(colour) + abs(white) * other).astype(np.uint8)


def _is_alone(curve: str) -> bool:
    """Whether a curve is the only one of its plot."""
    return curve == SPREAD


def _with_words(column: pa.ListArray, change: Callable[[str], str]) -> pa.ListArray:
    words = [change(word) for word in column.flatten().to_pylist()]
    return _with_values(column, pa.array(words, pa.string()))


def _repainted(column: pa.ListArray, paint: Callable[[Colours], Colours]) -> pa.ListArray:
    """Other colours, which `paint` gives for those (N, 3) that are there."""
    old = column.flatten().to_numpy(zero_copy_only=False).astype(np.uint32)
    new = paint((old[:, None] >> SHIFTS & 0xFF).astype(np.uint8)).astype(np.uint32)
    packed = (new << SHIFTS).sum(axis=1, dtype=np.uint32) | OPAQUE
    return _with_values(column, pa.array(packed, pa.uint32()))


def _with_values(column: pa.ListArray, values: pa.Array) -> pa.ListArray:
    """A column of lists as long as these, of other values."""
    lengths = pc.list_value_length(column).fill_null(0).to_numpy(zero_copy_only=False)
    offsets = pa.array(np.concatenate([[0], np.cumsum(lengths)]), pa.int32())
    return pa.ListArray.from_arrays(offsets, values, type=column.type, mask=column.is_null())
