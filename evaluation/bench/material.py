"""The input of the rows: one aerial surface of a recording, and all that it came from.
The whole pipeline runs over the recording, SLAM included, without truth. This is timed, and what
the stages pass to each other is kept for one surface."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airground.config import Config
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud, Source
from airground.core.events import (
    Aligned,
    DepthMapMade,
    FieldAdded,
    FrameAdded,
    GroundTracked,
    MavTracked,
    Sighted,
    SurfaceCast,
)
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import AerialSurface, DepthMap
from airground.dense.view_selection import PosedImage
from airground.errors import InputError
from airground.ground_map import GroundMap
from airground.ground_map.blocked_field import BlockedField
from airground.io.recording import Recording
from airground.pipeline import Pipeline
from evaluation.bench.report import RealTime
from evaluation.run.driver import drive, pipeline_for, watched
from evaluation.run.onlooker import Seen
from evaluation.run.tracking import TrackingTask, localizer_rng
from evaluation.run.tracking_apart import TrackingApart
from evaluation.setup.memory import AddedMemory, resident_mib
from evaluation.setup.setups import Setup

PARTS = 10
"""Parts of a recording after which the memory is read."""
ALIGNED_SURFACES = 3
"""The third aligned surface is kept: by then the ground map covers more than its start."""


@dataclass(frozen=True, eq=False)
class Material:
    """One aerial surface and the input of every stage for it.

    Attributes:
        depth_maps: The depth maps that were fused.
        reference: The view of the middle depth map.
        views: The views that were compared with the reference, in order of time.
        sighting: The surface, and the ground robot's map at its time.
        T_ground_mav: The aligned pose.
        ground_image: The ground robot's newest image at that time.
        ground_field: The distance field of the ground map's points.
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
        """The depth map whose view spans the volume."""
        return self.depth_maps[len(self.depth_maps) // 2]

    def depth_range(self) -> tuple[float, float]:
        """Nearest and farthest depth of that depth map [m]."""
        depth = self.reference_depth.depth
        return float(np.nanmin(depth)), float(np.nanmax(depth))

    @property
    def ground_cloud(self) -> PointCloud:
        return self.sighting.ground_cloud

    @property
    def heading(self) -> float:
        """Turn of `mav` in `ground` [rad]."""
        return self.T_ground_mav.heading()


@dataclass(frozen=True)
class Played:
    """Times of the whole pipeline over the recording.
    `frame_ms` holds by robot ("mav", "ground") the processor time of each image, with the inertial
    samples before it."""

    frame_ms: dict[str, list[float]]
    pipeline: RealTime


def play(
    recording: Recording, config: Config, threads: int, whole: bool
) -> tuple[Material, Played | None]:
    """Run the pipeline with SLAM over a recording, as `run` does, and keep the rows' material.

    Unless `whole`, stop once there is material, and report no times.

    Raises:
        InputError: No aerial surface could be aligned: there is no material.
    """
    setup = Setup(config)
    pipeline = pipeline_for(recording, setup, localizer_rng(0, recording.flight))
    gathering = _Gathering(recording, config, pipeline)
    with AddedMemory() as added, TrackingApart(TrackingTask(recording, None, setup, 0)) as tracking:
        if not whole:
            tracking.wait_until_ready()
            for seen in watched(pipeline, tracking.frames()):
                gathering.see(seen)
                if gathering.complete:
                    break
            return gathering.material(), None
        memory = MemoryLog(recording, tracking.pids)
        driven = drive(recording, tracking, pipeline, setup, [gathering, memory])
    frame_ms = {name: list(one.front_end.durations_ms) for name, one in driven.tracked.items()}
    peak_mib = None if added.mib is None else added.mib + driven.tracking_memory_mib
    real_time = RealTime(
        threads=threads,
        recorded_s=recording.duration_s,
        processing_s=driven.processing_s,
        cpu_s=driven.processor_s,
        real_time_factor=recording.duration_s / driven.processing_s,
        peak_memory_mib=peak_mib,
        resident_mib=tuple(memory.resident_mib),
    )
    return gathering.material(), Played(frame_ms, real_time)


class MemoryLog:
    """Reads the memory [MiB] that this and the tracking processes hold after each part of the
    recording; `resident_mib` stays empty if it is not counted."""

    def __init__(self, recording: Recording, tracking: Sequence[int]) -> None:
        self._processes = (os.getpid(), *tracking)
        stamps_ns = recording.of(Source.GROUND).camera_stamps
        ends_ns = np.linspace(int(stamps_ns[0]), int(stamps_ns[-1]), PARTS + 1)[1:]
        self._waiting_ns = [int(end_ns) for end_ns in ends_ns]
        self.resident_mib: list[float] = []

    def see(self, seen: Seen) -> None:
        ground = isinstance(seen.event, GroundTracked)
        while ground and self._waiting_ns and seen.event.stamp_ns >= self._waiting_ns[0]:
            self._waiting_ns.pop(0)
            now_mib = resident_mib(self._processes)
            self.resident_mib += [] if now_mib is None else [now_mib]


class _Gathering:
    """Consumes the pipeline's events, and keeps the material of one surface."""

    def __init__(self, recording: Recording, config: Config, pipeline: Pipeline) -> None:
        self._recording, self._config, self._pipeline = recording, config, pipeline
        self._kept: Material | None = None
        self._aligned = 0
        self._poses: dict[int, SE3] = {}
        self._views: dict[int, list[int]] = {}
        self._made: dict[int, DepthMap] = {}
        self._fused: list[DepthMap] = []
        self._of_surface: list[DepthMap] = []
        self._latest: tuple[Sighting, list[DepthMap]] | None = None

    @property
    def complete(self) -> bool:
        return self._aligned >= ALIGNED_SURFACES

    def material(self) -> Material:
        if self._kept is None:
            raise InputError(
                f"{self._recording.path}: no aerial surface could be aligned with the ground map, "
                "so there is nothing to time; give another --recording"
            )
        return self._kept

    def see(self, seen: Seen) -> None:
        if self.complete:
            return
        event = seen.event
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
                self._latest, self._of_surface, self._fused = None, self._fused, []
            case Sighted():
                self._latest = (event.sighting, self._of_surface)
            case Aligned() if event.alignment.accepted and self._latest is not None:
                self._aligned += 1
                self._kept = self._material(*self._latest, event.alignment.T_ground_mav)

    def _material(
        self, sighting: Sighting, depth_maps: list[DepthMap], T_ground_mav: SE3
    ) -> Material:
        reference_ns = depth_maps[len(depth_maps) // 2].stamp_ns
        ground_map = self._pipeline.mapping.ground_map
        assert isinstance(ground_map, GroundMap)
        return Material(
            self._recording,
            self._config,
            self._recording.mav.calibration.camera,
            self._recording.ground.calibration.camera,
            depth_maps,
            self._posed(reference_ns),
            [self._posed(stamp_ns) for stamp_ns in sorted(self._views[reference_ns])],
            sighting,
            T_ground_mav,
            self._recording.ground.image_at(sighting.ground_stamp_ns),
            ground_map.field().copy(),
        )

    def _posed(self, stamp_ns: int) -> PosedImage:
        image = self._recording.mav.image_at(stamp_ns).image
        return PosedImage(stamp_ns, image, self._poses[stamp_ns])
