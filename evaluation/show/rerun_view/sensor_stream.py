"""The stream that all drawing goes to: one timeline, its level of detail, its entity names."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from airground.core.cloud import Source
from airground.core.se3 import SE3
from evaluation.show.figures.scene_pictures import GROUND_PATH, MAV_PATH

logger = logging.getLogger(__name__)

APPLICATION = "airground"
PATH_COLOUR = {Source.GROUND: GROUND_PATH, Source.MAV: MAV_PATH}
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


LevelName = Literal["summary", "stages", "all"]


@dataclass(frozen=True)
class Level:
    """What a recording for the viewer holds of each second.

    Attributes:
        pose_hz: Poses, and points of the curves.
        image_hz: Images of each robot with their corners.
        image_scale: Their size, as a share of the camera's.
        jpeg_quality: Their quality, 1 to 100.
        depth_map_hz: Depth maps and their errors.
        cloud_hz: Both maps, each drawn anew as a whole.
        voxel_m: Points of maps and surfaces are this far apart [m].
    """

    pose_hz: float
    image_hz: float
    image_scale: float
    jpeg_quality: int
    depth_map_hz: float
    cloud_hz: float
    voxel_m: float


LEVELS: dict[LevelName, Level] = {
    "summary": Level(5, 1, 0.5, 70, 0.5, 0.25, 0.05),
    "stages": Level(10, 5, 0.75, 75, 2, 0.5, 0.03),
    "all": Level(30, 30, 1.0, 75, 30, 0.5, 0.025),
}


class Pace:
    """Lets through so many a second, by sensor time.

    Args:
        hz: How many.
    """

    def __init__(self, hz: float) -> None:
        # Half a frame of 30 Hz early is in time: frames do not come at whole multiples.
        self._apart_ns = round(1e9 / hz) - 16_000_000
        self._last_ns: int | None = None

    def due(self, stamp_ns: int) -> bool:
        """Whether enough time has passed; if so, the next wait begins."""
        if self._last_ns is not None and stamp_ns - self._last_ns < self._apart_ns:
            return False
        self._last_ns = stamp_ns
        return True


GROUND, MAV, SURFACE, WORLD, COSTS = "ground", "mav", "surface", "world", "cost_map"
"""Frames: both robots' maps, the newest aerial surface, the true world, pixels of the cost map."""

ROBOT = {Source.GROUND: GROUND, Source.MAV: MAV}
"""A robot's name, which is also that of its map's frame."""

TRUTH = "/truth"
"""All that is true and that no robot knows."""


def camera_frame(robot: str) -> str:
    return f"{robot}_camera"


def image_frame(robot: str) -> str:
    return f"{robot}_image"
