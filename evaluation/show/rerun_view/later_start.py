"""A second clock that begins at a moment: a layout cannot place the time cursor, but a viewer
starts where its timeline begins."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pyarrow as pa

from evaluation.show.rerun_view.sensor_stream import TIMELINE

OF_A_MOMENT = {"Scalars:scalars", "TextLog:text"}
"""Components that say something of their time only; others hold until they are set again."""


def also_from(since_ns: int, clock: str, batch: pa.RecordBatch) -> Iterator[pa.RecordBatch]:
    """Rows with their stamps of `sensor_time` also on a clock that begins at `since_ns`.

    There a viewer starts with all that was last set before; curves and messages of before are left
    out of it, since they would all lie at its beginning.
    """
    if TIMELINE not in batch.schema.names:
        yield batch
        return
    stamps = batch.column(TIMELINE).cast(pa.int64()).to_numpy()
    early = np.zeros(len(stamps), bool)
    if not OF_A_MOMENT.isdisjoint(batch.schema.names):
        early = stamps < since_ns
    if early.any():
        yield batch.filter(pa.array(early))
    if not early.all():
        rest, stamps = batch.filter(pa.array(~early)), stamps[~early]
        times = pa.array(np.maximum(stamps, since_ns)).cast(pa.duration("ns"))
        meaning = {"rerun:kind": "index", "rerun:index_name": clock}
        field = pa.field(clock, times.type, metadata=meaning)
        position = rest.schema.get_field_index(TIMELINE) + 1
        yield rest.add_column(position, field, times)
