"""A run made by hand: one of each event, with numbers that are easy to find again."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any, Self, cast

import numpy as np
import open3d as o3d
import pyarrow as pa
from rerun.chunk import RrdReader

from airground.config import Config
from airground.core.belief import Alignment, Belief, CostMap, HeightMap
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud, Source
from airground.core.events import (
    Aligned,
    BeliefUpdated,
    CostMapComputed,
    DepthMapMade,
    Event,
    FieldAdded,
    GroundMapExtended,
    GroundTracked,
    HeightMapsMade,
    Initializing,
    MapAugmented,
    MavTracked,
    SurfaceCast,
    TrackingLost,
)
from airground.core.messages import GroundImage, MavImage, RobotCalibration
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import AerialSurface, DepthMap
from airground.slam.front_end import TrackedCorners, TrackedPose, Tracking
from airground.tracking import TrackedFrame
from evaluation.run.onlooker import Onlooker, Seen
from evaluation.show.rerun_view.run_view import RunView
from evaluation.show.rerun_view.sensor_stream import LevelName
from sim.recording.truth import Truth

SECOND = 1_000_000_000
CAMERA = PinholeCamera(64, 48, 60.0, 60.0, 31.5, 23.5)
LENS = RobotCalibration(CAMERA, SE3.identity(), SE3.identity())
DOWN = SE3.from_rotation_vector([np.pi, 0, 0], [0.0, 0.0, 2.0])
T_GROUND_MAV = SE3.from_heading(0.3, [1.0, 0.2, 0.1])
T_BELIEVED = SE3.from_heading(0.3, [1.1, 0.2, 0.1])
CORNERS = np.array([[10.0, 12.0], [40.5, 30.0], [63.0, 47.0]], np.float32)
MAPPED = np.array([True, False, True])
CELLS_PER_M = 10.0
COSTS = CostMap(
    np.linspace(0, 1, 30 * 20, dtype=np.float32).reshape(30, 20),
    np.array([-0.5, -1.0]),
    CELLS_PER_M,
    0.3,
    "zmssd",
)
BELIEF = Belief(
    stamp_ns=3 * SECOND,
    particles=np.array([[1.0, 0.2, 0.3], [1.2, 0.3, 0.3], [1.1, 0.1, 0.3]]),
    estimate=np.array([1.1, 0.2, 0.3]),
    covariance=np.diag([0.04, 0.01]),
    cost=0.1,
    height_offset=0.1,
    T_ground_mav=T_BELIEVED,
    converged=True,
    refusal="",
    overlap=0.8,
)
DEPTH = np.full((48, 64), 1.75, np.float32)
DEPTH[:4] = np.nan
CLOUD = PointCloud(
    np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.2], [0.0, 0.7, 0.1]], np.float32),
    np.full((3, 3), 120, np.uint8),
)
SURFACE = AerialSurface(3 * SECOND, 2 * SECOND, CAMERA, DOWN, DEPTH, CLOUD, 1)


class KnownTruth:
    """The MAV's map lies where the alignment says; its depth is 2 cm less than measured."""

    def surface(self, robot: str) -> Self:
        return self

    @cached_property
    def mesh(self) -> o3d.geometry.TriangleMesh:
        return o3d.geometry.TriangleMesh.create_box(2.0, 2.0, 0.5)

    def T_world_mav_camera(self, stamp_ns: int) -> SE3:
        return T_GROUND_MAV @ DOWN

    def T_world_ground_camera(self, stamp_ns: int) -> SE3:
        return SE3.identity()

    def T_world_camera(self, robot: str, stamp_ns: int) -> SE3:
        mav, ground = self.T_world_mav_camera, self.T_world_ground_camera
        return (mav if robot == "mav" else ground)(stamp_ns)

    def cast(self, camera: PinholeCamera, T_world_camera: SE3) -> np.ndarray:
        return np.full((camera.height, camera.width), 1.73, np.float32)


TRUTH = cast(Truth, KnownTruth())
CONFIG = Config()
TIMES_NS = SECOND // 2, 4 * SECOND
NAME, LENSES = "scripted", dict.fromkeys(Source, LENS)


def mav_frame(stamp_ns: int, tracking: Tracking = Tracking.TRACKED) -> TrackedFrame:
    image = MavImage(stamp_ns, np.full((48, 64), 90, np.uint8))
    return TrackedFrame(image, _pose(stamp_ns, tracking, DOWN))


def ground_frame(stamp_ns: int, tracking: Tracking = Tracking.TRACKED) -> TrackedFrame:
    colour = np.full((48, 64, 3), (200, 40, 40), np.uint8)
    image = GroundImage(stamp_ns, colour, np.full((48, 64), 2.0, np.float32))
    return TrackedFrame(image, _pose(stamp_ns, tracking, SE3.identity()))


def _pose(stamp_ns: int, tracking: Tracking, T_map_camera: SE3) -> TrackedPose:
    if tracking is not Tracking.TRACKED:
        return TrackedPose(stamp_ns, tracking, None)
    return TrackedPose(
        stamp_ns,
        tracking,
        T_map_camera,
        covariance=np.diag([1e-4] * 6),
        corners=TrackedCorners(CORNERS, MAPPED),
    )


def seen_events(accepted: bool = True) -> list[Seen]:
    """From the first image to the augmented map; then the MAV is lost."""
    ground, mav = ground_frame(SECOND), mav_frame(2 * SECOND)
    newest = mav_frame(3 * SECOND)
    sighting = Sighting(SURFACE, CLOUD, 3 * SECOND, DOWN, SECOND, SE3.identity(), 0.3)
    heights = HeightMap(np.full((12, 8), 0.4, np.float32), np.array([-0.6, -0.4]), CELLS_PER_M)
    t = 3 * SECOND
    refusal = "" if accepted else "too few inliers"
    alignment = Alignment(t, T_GROUND_MAV, 0.9, 0.006, accepted, refusal)
    steps: list[tuple[Event, TrackedFrame, Sighting | None]] = [
        (Initializing(SECOND // 2, Source.GROUND), _waiting(), None),
        (GroundTracked(SECOND, SE3.identity()), ground, None),
        (GroundMapExtended(SECOND, 1), ground, None),
        (MavTracked(2 * SECOND, DOWN), mav, None),
        (MavTracked(t, DOWN), newest, None),
        (DepthMapMade(t, DepthMap(2 * SECOND, CAMERA, DOWN, DEPTH, _grey(), 9)), newest, None),
        (FieldAdded(t, 2 * SECOND), newest, None),
        (SurfaceCast(t, SURFACE), newest, sighting),
        (HeightMapsMade(t, heights, heights), newest, sighting),
        (CostMapComputed(t, COSTS), newest, sighting),
        (BeliefUpdated(t, BELIEF), newest, sighting),
        (Aligned(t, alignment), newest, sighting),
    ]
    if accepted:
        steps.append((MapAugmented(t, CLOUD), newest, sighting))
    lost = mav_frame(4 * SECOND, Tracking.LOST)
    steps.append((TrackingLost(4 * SECOND, Source.MAV), lost, sighting))
    return [Seen(event, 12.5, frame, sighting) for event, frame, sighting in steps]


def _waiting() -> TrackedFrame:
    return ground_frame(SECOND // 2, Tracking.INITIALIZING)


def _grey() -> np.ndarray:
    return np.full((48, 64), 90, np.uint8)


def show(onlooker: Onlooker, events: list[Seen]) -> None:
    for seen in events:
        onlooker.see(seen)


def written(
    path: Path,
    level: LevelName = "all",
    truth: Truth | None = TRUTH,
    events: list[Seen] | None = None,
) -> Path:
    """The .rrd file of the scripted run."""
    view = RunView(path, NAME, LENSES, truth, CONFIG, TIMES_NS, level)
    show(view, seen_events() if events is None else events)
    view.close()
    return path


class ReadBack:
    """What an .rrd file holds, by entity.

    Args:
        path: Of the file.
    """

    def __init__(self, path: Path) -> None:
        self._batches: dict[str, list[pa.RecordBatch]] = {}
        self.timelines: set[str] = set()
        for chunk in RrdReader(path).stream():
            self._batches.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())
            self.timelines |= set(chunk.timeline_names)

    @property
    def entities(self) -> set[str]:
        return set(self._batches)

    def values(self, entity: str, component: str) -> list[Any]:
        """Of every row, in order of time."""
        rows: list[tuple[int, Any]] = []
        for batch in self._batches[entity]:
            if component in batch.schema.names:
                stamps = self._stamps(batch)
                rows += zip(stamps, batch.column(component).to_pylist(), strict=True)
        return [value for _, value in sorted(rows, key=lambda row: row[0]) if value is not None]

    def stamps_ns(self, entity: str) -> list[int]:
        """When something was said of an entity; 0 where it holds at all times."""
        return sorted(stamp for batch in self._batches[entity] for stamp in self._stamps(batch))

    @staticmethod
    def _stamps(batch: pa.RecordBatch) -> list[int]:
        if "sensor_time" not in batch.schema.names:
            return [0] * batch.num_rows
        return batch.column("sensor_time").cast(pa.int64()).to_pylist()
