"""What the rows work on: one aerial surface of a recording, and all that it came from.

The whole pipeline runs over the recording, SLAM included and without any truth. This is
timed, and what the stages handed each other on the way is kept for one surface.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from airground.config import Config
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud, Source
from airground.core.events import (
    Aligned,
    DepthMapMade,
    Event,
    FieldAdded,
    FrameAdded,
    GroundTracked,
    MavTracked,
    SurfaceCast,
)
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface, DepthMap
from airground.dense.view_selection import PosedImage
from airground.errors import InputError
from airground.ground_map import GroundMap
from airground.ground_map.blocked_field import BlockedField
from airground.io.recording import Recording
from airground.pipeline import Pipeline, Sighting, sight
from evaluation.run.drops import nothing_dropped
from evaluation.run.recording import pipeline_rng
from evaluation.run.tracking import TrackingTask
from evaluation.run.tracking_process import TrackingApart
from evaluation.setup.memory import resident_mib
from evaluation.setup.setups import Setup

PARTS = 10
"""Memory is looked at so many times over a recording."""

ALIGNED_SURFACES = 3
"""The surface that is kept is this one of those that were aligned: by then there is a map."""


@dataclass(frozen=True, eq=False)
class Material:
    """One aerial surface and what the stages had at hand for it.

    Attributes:
        recording: Where it comes from.
        config: The parameters that it was made with.
        mav_camera, ground_camera: Of the images.
        depth_maps: That were fused.
        reference: The view of the middle depth map ...
        views: ... and those that were compared with it, in order of time.
        sighting: The surface, and the ground robot's map by then.
        T_ground_mav: As it was aligned.
        ground_image: The ground robot's newest image by then.
        ground_field: The distance field that its map's points came from.
    """

    recording: Recording
    config: Config
    mav_camera: PinholeCamera
    ground_camera: PinholeCamera
    depth_maps: list[DepthMap]
    reference: PosedImage
    views: list[PosedImage]
    sighting: Sighting
    T_ground_mav: SE3
    ground_image: GroundImage
    ground_field: BlockedField

    @property
    def surface(self) -> AerialSurface:
        return self.sighting.surface

    @property
    def reference_depth(self) -> DepthMap:
        """The depth map whose view the volume stands before."""
        return self.depth_maps[len(self.depth_maps) // 2]

    @property
    def ground_cloud(self) -> PointCloud:
        return self.sighting.ground_cloud

    @property
    def robot_position(self) -> NDArray[np.float64]:
        """(2,) the ground robot in `ground` [m]."""
        return self.sighting.T_ground_camera.translation[:2]

    @property
    def heading(self) -> float:
        """Turn of `mav` in `ground` [rad]."""
        return self.T_ground_mav.heading()


@dataclass(frozen=True)
class Played:
    """How long the whole pipeline took over the recording.

    Attributes:
        frame_ms: By robot ("mav", "ground"): processor time of each image, with the inertial
            samples before it.
        recorded_s: How much was played.
        processing_s: By the clock, decoding included.
        cpu_s: Of mapping and tracking.
        resident_mib: What all processes held after each of ten parts; none if nobody counts it.
        tracking_memory_mib: The most that tracking ever held.
    """

    frame_ms: dict[str, list[float]]
    recorded_s: float
    processing_s: float
    cpu_s: float
    resident_mib: list[float]
    tracking_memory_mib: float


def play(recording: Recording, config: Config, whole: bool) -> tuple[Material, Played | None]:
    """Run the pipeline with SLAM over a recording, as `run` does, and keep what the rows need.

    Args:
        recording: Of both robots.
        config: The pipeline's parameters.
        whole: To its end; else only until the material is there, and nothing is told of how
            long it took.

    Raises:
        InputError: No aerial surface could be aligned, so that there is nothing to work on.
    """
    task = TrackingTask(recording, None, Setup(config), 0, nothing_dropped(recording))
    pipeline = Pipeline(config, recording.mav, recording.ground, pipeline_rng(0))
    gathering = _Gathering(recording, config, pipeline)
    with TrackingApart(task) as tracking:
        memory = MemoryLog(recording, tracking.pids)
        tracking.wait_until_ready()
        started, cpu = time.perf_counter(), time.process_time()
        for event in pipeline.run(tracking.frames()):
            gathering.take(event)
            memory.take(event)
            if gathering.complete and not whole:
                return gathering.material(), None
        report = tracking.report()
        processing_s, cpu_s = time.perf_counter() - started, time.process_time() - cpu
    return gathering.material(), Played(
        {robot: one.front_end.durations_ms for robot, one in report.tracked.items()},
        recording.duration_s,
        processing_s,
        cpu_s + report.processor_s,
        memory.resident_mib,
        report.peak_memory_mib,
    )


class MemoryLog:
    """Listens to the pipeline, and looks at the memory after each part of the recording."""

    def __init__(self, recording: Recording, tracking: Sequence[int | str]) -> None:
        self._processes = ("self", *tracking)
        stamps_ns = recording.stamps_ns(Source.GROUND)
        first_ns, last_ns = int(stamps_ns[0]), int(stamps_ns[-1])
        ends_ns = np.linspace(first_ns, last_ns, PARTS + 1)[1:]
        self._waiting_ns = [int(end_ns) for end_ns in ends_ns]
        self.resident_mib: list[float] = []

    def take(self, event: Event) -> None:
        ground = isinstance(event, GroundTracked)
        while ground and self._waiting_ns and event.stamp_ns >= self._waiting_ns[0]:
            self._waiting_ns.pop(0)
            now_mib = resident_mib(*self._processes)
            self.resident_mib += [] if now_mib is None else [now_mib]


@dataclass
class _Gathering:
    """Listens to the pipeline."""

    recording: Recording
    config: Config
    pipeline: Pipeline
    kept: Material | None = None
    _aligned: int = 0
    _poses: dict[int, SE3] = field(default_factory=dict)
    _views: dict[int, list[int]] = field(default_factory=dict)
    _made: dict[int, DepthMap] = field(default_factory=dict)
    _fused: list[DepthMap] = field(default_factory=list)
    _latest: tuple[Sighting, list[DepthMap]] | None = None

    @property
    def complete(self) -> bool:
        return self._aligned >= ALIGNED_SURFACES

    def material(self) -> Material:
        if self.kept is None:
            raise InputError(
                f"{self.recording.path}: no aerial surface could be aligned with the ground map, "
                "so that there is nothing to time; give another --recording"
            )
        return self.kept

    def take(self, event: Event) -> None:
        if self.complete:
            return
        match event:
            case MavTracked():
                self._poses[event.stamp_ns] = event.T_mav_camera
            case FrameAdded():
                self._views.setdefault(event.reference_stamp_ns, []).append(event.stamp_ns)
            case DepthMapMade():
                self._made[event.depth_map.stamp_ns] = event.depth_map
            case FieldAdded():
                self._fused.append(self._made.pop(event.reference_stamp_ns))
            case SurfaceCast():
                sighting = sight(event.surface, self.pipeline.mapping)
                self._latest = (sighting, self._fused) if sighting is not None else None
                self._fused = []
            case Aligned() if event.alignment.accepted and self._latest is not None:
                self._aligned += 1
                self.kept = self._chosen(*self._latest, event.alignment.T_ground_mav)

    def _chosen(
        self, sighting: Sighting, depth_maps: list[DepthMap], T_ground_mav: SE3
    ) -> Material:
        reference_ns = depth_maps[len(depth_maps) // 2].stamp_ns
        return Material(
            self.recording,
            self.config,
            self.recording.mav.camera,
            self.recording.ground.camera,
            depth_maps,
            self._posed(reference_ns),
            [self._posed(stamp_ns) for stamp_ns in sorted(self._views[reference_ns])],
            sighting,
            T_ground_mav,
            self.recording.ground_image_at(sighting.ground_stamp_ns),
            self._ground_field(),
        )

    def _ground_field(self) -> BlockedField:
        ground_map = self.pipeline.mapping.ground_map
        assert isinstance(ground_map, GroundMap)
        return ground_map.field().copy()

    def _posed(self, stamp_ns: int) -> PosedImage:
        image = self.recording.mav_image_at(stamp_ns).image
        return PosedImage(stamp_ns, image, self._poses[stamp_ns])
