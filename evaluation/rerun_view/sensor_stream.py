"""The stream that all drawing goes to: one timeline, the sensors' time."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from airground.core.se3 import SE3

logger = logging.getLogger(__name__)

APPLICATION = "airground"
TIMELINE = "sensor_time"

_FEW_CHUNKS = rr.ChunkBatcherConfig(flush_tick=2.0, flush_num_bytes=4 << 20)
"""A viewer goes slow over many small chunks, not over much data."""
_AT_ONCE = rr.ChunkBatcherConfig(flush_tick=0.05)


class SensorStream:
    """Writes to a file, and to a viewer where one listens.

    The layout lies in the file, which therefore opens the same way in any viewer.

    Args:
        path: The .rrd file to write.
        name: Of the recording, as the viewer shows it.
        layout: Where the viewer shows what.
        viewer: Address of a viewer that listens ("rerun+http://..."); None for none.
    """

    def __init__(
        self, path: Path, name: str, layout: rrb.Blueprint, viewer: str | None = None
    ) -> None:
        batches = _FEW_CHUNKS if viewer is None else _AT_ONCE
        # Its properties hold the time of day: the only bytes that would differ between runs.
        self._stream = rr.RecordingStream(
            APPLICATION, recording_id=name, send_properties=False, batcher_config=batches
        )
        self._stream.set_log_time_enabled(False)
        sinks: list[rr.FileSink | rr.GrpcSink] = [rr.FileSink(str(path))]
        if viewer is not None:
            sinks.append(rr.GrpcSink(viewer))
        self._stream.set_sinks(*sinks, default_blueprint=layout)
        self._stream.send_recording_name(name)

    def log(self, stamp_ns: int, entity: str, *what: rr.AsComponents) -> None:
        """Say what an entity is from `stamp_ns` on (sensor time)."""
        self._stream.set_time(TIMELINE, duration=np.timedelta64(stamp_ns, "ns"))
        self._stream.log(entity, *what)

    def log_always(self, entity: str, *what: rr.AsComponents) -> None:
        """Say what an entity is at all times."""
        self._stream.log(entity, *what, static=True)

    def put_in_frame(self, frame: str, *entities: str) -> None:
        """What is drawn under these entities has coordinates in a named frame."""
        for entity in entities:
            self.log_always(entity, rr.CoordinateFrame(frame))

    def close(self) -> None:
        """Write what is still in memory, and end the file."""
        try:
            self._stream.flush()
        except RuntimeError as error:
            # A viewer that was closed meanwhile; the file gets its data all the same.
            logger.warning("the viewer is gone: %s", error)
        self._stream.disconnect()


def transform(T_parent_child: SE3, parent: str, child: str) -> rr.Transform3D:
    """A frame's place in another, both by name."""
    return rr.Transform3D(
        translation=T_parent_child.translation,
        quaternion=rr.Quaternion(xyzw=T_parent_child.quaternion_xyzw()),
        parent_frame=parent,
        child_frame=child,
    )
