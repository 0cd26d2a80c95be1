"""The output of all drawing: one timeline, its level of detail, and names of frames."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from matplotlib.colors import to_rgb
from rerun.chunk import Chunk

from airground.core.cloud import Source
from airground.core.se3 import SE3
from evaluation.show.figures.scene_pictures import GROUND_PATH, MAV_PATH

logger = logging.getLogger(__name__)

APPLICATION = "airground"
TIMELINE = "sensor_time"

GROUND, MAV, SURFACE, WORLD, COSTS = "ground", "mav", "surface", "world", "cost_map"
"""Frames: both robots' maps, the newest aerial surface, the true world, pixels of the cost map."""
ROBOT: dict[Source, Literal["mav", "ground"]] = {Source.GROUND: "ground", Source.MAV: "mav"}
"""A robot's name, which is also that of its map's frame."""
TRUTH = "/truth"
"""Root of all entities that no robot has access to."""
PATH_COLOUR = {Source.GROUND: GROUND_PATH, Source.MAV: MAV_PATH}
TRUTH_COLOUR = (255, 60, 200)

_FEW_CHUNKS = rr.ChunkBatcherConfig(flush_tick=2.0, flush_num_bytes=4 << 20)
"""Many small chunks slow a viewer down, not the amount of data."""
_AT_ONCE = rr.ChunkBatcherConfig(flush_tick=0.05)


class SensorStream:
    """Writes to an .rrd file, and to a viewer if one listens at an address ("rerun+http://...").
    The file contains the layout, so that every viewer opens it in the same way."""

    def __init__(
        self, path: Path, name: str, layout: rrb.Blueprint, viewer: str | None = None
    ) -> None:
        batches = _FEW_CHUNKS if viewer is None else _AT_ONCE
        # Properties contain the time of day, the only bytes that would differ between runs.
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
        """Set an entity from `stamp_ns` on (sensor time)."""
        self._stream.set_time(TIMELINE, duration=np.timedelta64(stamp_ns, "ns"))
        self._stream.log(entity, *what)

    def log_always(self, entity: str, *what: rr.AsComponents) -> None:
        """Set an entity for all times."""
        self._stream.log(entity, *what, static=True)

    def send(self, chunks: Iterable[Chunk]) -> None:
        """Add what was read from another file."""
        rr.send_chunks(chunks, recording=self._stream)

    def put_in_frame(self, frame: str, *entities: str) -> None:
        """Give the coordinates of these entities a named frame."""
        for entity in entities:
            self.log_always(entity, rr.CoordinateFrame(frame))

    def close(self) -> None:
        """Write the rest, and end the file."""
        try:
            self._stream.flush()
        except RuntimeError as error:
            # The viewer was closed; the file is complete nevertheless.
            logger.warning("the viewer is gone: %s", error)
        self._stream.disconnect()


def transform(T_parent_child: SE3, parent: str, child: str) -> rr.Transform3D:
    """The pose of a named frame in another."""
    return rr.Transform3D(
        translation=T_parent_child.translation,
        quaternion=rr.Quaternion(xyzw=T_parent_child.quaternion_xyzw()),
        parent_frame=parent,
        child_frame=child,
    )


LevelName = Literal["summary", "stages", "all"]


@dataclass(frozen=True)
class Level:
    """Level of detail of a recording for the viewer.

    Attributes:
        pose_hz: Rate of poses, and of points of the curves [Hz].
        image_hz: Rate of each robot's images with their corners [Hz].
        image_scale: Size of images, as a share of the camera's.
        jpeg_quality: Quality of images, 1 to 100.
        depth_map_hz: Rate of depth maps and their errors [Hz].
        cloud_hz: Rate of both maps, each drawn as a whole [Hz].
        voxel_m: Spacing of the points of maps and surfaces [m].
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
    """Selects events at a rate [Hz] of sensor time."""

    def __init__(self, hz: float) -> None:
        # Half a frame of 30 Hz early is in time: stamps are no whole multiples of the period.
        self._apart_ns = round(1e9 / hz) - 16_000_000
        self._last_ns: int | None = None

    def due(self, stamp_ns: int) -> bool:
        """Whether the period has passed since the last selected stamp; if so, select this one."""
        if self._last_ns is not None and stamp_ns - self._last_ns < self._apart_ns:
            return False
        self._last_ns = stamp_ns
        return True


def rgb(colour: str) -> tuple[int, int, int]:
    """A colour such as "#35C46A" as the viewer reads it, each part from 0 to 255."""
    red, green, blue = np.rint(255 * np.array(to_rgb(colour))).astype(int).tolist()
    return red, green, blue


def camera_frame(robot: str) -> str:
    return f"{robot}_camera"


def image_frame(robot: str) -> str:
    return f"{robot}_image"
