"""What the rows work on: one aerial surface of a recording, and all that it came from.

The whole pipeline runs over the recording, SLAM included and without any truth. This is
timed, and what the stages handed each other on the way is kept for one surface.
"""

from __future__ import annotations

import time
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
from airground.io.read_ahead import run_ahead
from airground.io.recording import Recording
from airground.pipeline import Pipeline, Sighting, sight
from airground.slam.front_ends import GROUND, MAV, Ingredients, make_front_end
from airground.tracking import FrontEnds, Trackers
from evaluation.bench.memory import resident_mib
from evaluation.runs.recording import FRAMES_AHEAD
from evaluation.runs.watched_front_end import WatchedFrontEnd

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
        frame_ms: By robot ("mav", "ground"): each image with the inertial samples before it.
        recorded_s: How much was played.
        processing_s: By the clock, decoding included.
        cpu_s: Of the whole process.
        resident_mib: What the process held after each of ten parts; fewer if it was cut short
            or nobody counts it.
    """

    frame_ms: dict[str, list[float]]
    recorded_s: float
    processing_s: float
    cpu_s: float
    resident_mib: list[float]


def play(recording: Recording, config: Config, whole: bool) -> tuple[Material, Played]:
    """Run the pipeline with SLAM over a recording, and keep what the rows need.

    Args:
        recording: Of both robots.
        config: The pipeline's parameters.
        whole: To its end; else only until the material is there.

    Raises:
        InputError: No aerial surface could be aligned, so that there is nothing to work on.
    """
    mav_rng, ground_rng, rng = np.random.default_rng(0).spawn(3)
    mav = WatchedFrontEnd(make_front_end(MAV, "slam", Ingredients(recording.mav, config, mav_rng)))
    ground = WatchedFrontEnd(
        make_front_end(GROUND, "slam", Ingredients(recording.ground, config, ground_rng))
    )
    trackers = Trackers(recording.mav, recording.ground, FrontEnds(mav, ground))
    pipeline = Pipeline(config, recording.mav, recording.ground, rng)
    gathering = _Gathering(recording, config, pipeline)
    memory = MemoryLog(recording)
    started, cpu = time.perf_counter(), time.process_time()
    frames = trackers.frames(recording.messages())
    for event in pipeline.run(run_ahead(frames, FRAMES_AHEAD)):
        gathering.take(event)
        memory.take(event)
        if gathering.complete and not whole:
            break
    processing_s, cpu_s = time.perf_counter() - started, time.process_time() - cpu
    frame_ms = {"mav": mav.durations_ms, "ground": ground.durations_ms}
    return gathering.material(), Played(
        frame_ms, recording.duration_s, processing_s, cpu_s, memory.resident_mib
    )


class MemoryLog:
    """Listens to the pipeline, and looks at the memory after each part of the recording."""

    def __init__(self, recording: Recording) -> None:
        stamps_ns = recording.stamps_ns(Source.GROUND)
        first_ns, last_ns = int(stamps_ns[0]), int(stamps_ns[-1])
        ends_ns = np.linspace(first_ns, last_ns, PARTS + 1)[1:]
        self._waiting_ns = [int(end_ns) for end_ns in ends_ns]
        self.resident_mib: list[float] = []

    def take(self, event: Event) -> None:
        ground = isinstance(event, GroundTracked)
        while ground and self._waiting_ns and event.stamp_ns >= self._waiting_ns[0]:
            self._waiting_ns.pop(0)
            now_mib = resident_mib()
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
        )

    def _posed(self, stamp_ns: int) -> PosedImage:
        image = self.recording.mav_image_at(stamp_ns).image
        return PosedImage(stamp_ns, image, self._poses[stamp_ns])
