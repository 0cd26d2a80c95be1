"""One pass over a recording: both robots map, and every aerial surface becomes a sighting."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from airground.core.cloud import PointCloud, Source
from airground.core.events import (
    DepthMapMade,
    Event,
    FieldAdded,
    SurfaceCast,
)
from airground.core.se3 import SE3
from airground.core.surface import DepthMap
from airground.io.recording import Recording
from airground.pipeline import Mapping, Sighting, sight
from airground.tracking import TrackedFrame, Trackers
from airground.warm_up import warm_up
from evaluation.run.front_ends import front_ends_for
from evaluation.run.onlooker import STAGE_OF, timed
from evaluation.setup.environment import settle
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import Tracked
from sim.recording.truth import Truth


@dataclass
class Maps:
    """What one pass left.

    Attributes:
        sightings: In order of time, one an aerial surface.
        depth_maps: Of each sighting, the depth maps that were fused.
        durations_ms: Of each timed stage.
        tracked: What the front ends said, by robot ("mav", "ground").
        processing_s: Wall time of the pass, decoding included.
    """

    sightings: list[Sighting] = field(default_factory=list)
    depth_maps: list[list[DepthMap]] = field(default_factory=list)
    durations_ms: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    tracked: dict[str, Tracked] = field(default_factory=dict)
    processing_s: float = 0.0


@dataclass(frozen=True, eq=False)
class GroundPass:
    """What a ground robot mapped on its own.

    Attributes:
        cloud_ground: Its map at the end.
        T_ground_camera: Where its camera was at last.
    """

    cloud_ground: PointCloud
    T_ground_camera: SE3


def map_recording(recording: Recording, truth: Truth, setup: Setup, seed: int) -> Maps:
    """Run the upper half of Figure 4 over a whole recording."""
    rng = np.random.default_rng([seed, 0])
    watched = front_ends_for(setup, recording, truth, rng)
    trackers = Trackers(
        recording.mav.calibration, recording.ground.calibration, watched.front_ends()
    )
    mapping = Mapping(setup.config, recording.mav.calibration, recording.ground.calibration)
    maps = Maps()
    made: dict[int, DepthMap] = {}
    fused: list[DepthMap] = []
    # Compiling is no part of what is timed.
    warm_up(setup.config, np.random.default_rng(0))
    settle()
    started = time.perf_counter()
    for event, duration_ms in timed(_events(trackers.frames(recording.messages()), mapping)):
        if type(event) in STAGE_OF:
            maps.durations_ms[STAGE_OF[type(event)]].append(duration_ms)
        match event:
            case DepthMapMade():
                made[event.depth_map.stamp_ns] = event.depth_map
            case FieldAdded():
                fused.append(made.pop(event.reference_stamp_ns))
            case SurfaceCast():
                sighting = sight(event.surface, mapping)
                if sighting is not None:
                    maps.sightings.append(sighting)
                    maps.depth_maps.append(fused)
                fused = []
    trackers.finish()
    maps.processing_s = time.perf_counter() - started
    maps.tracked = watched.tracked()
    return maps


def map_ground(recording: Recording, truth: Truth, setup: Setup, seed: int) -> GroundPass | None:
    """Run the ground robot's part of Figure 4 over a whole recording.

    Returns:
        What it left, or None where the robot never knew where it was.
    """
    watched = front_ends_for(setup, recording, truth, np.random.default_rng([seed, 0]))
    trackers = Trackers(
        recording.mav.calibration, recording.ground.calibration, watched.front_ends()
    )
    mapping = Mapping(setup.config, recording.mav.calibration, recording.ground.calibration)
    # The MAV sees nothing, and so costs nothing.
    blind = {Source.MAV: recording.mav.camera_stamps.tolist()}
    for _ in _events(trackers.frames(recording.messages(blind)), mapping):
        pass
    mapping.correct_ground(trackers.finish())
    live = watched.ground.live_poses()
    if not live:
        return None
    return GroundPass(mapping.ground_cloud(), live[-1][1])


def _events(frames: Iterable[TrackedFrame], mapping: Mapping) -> Iterator[Event]:
    for frame in frames:
        yield from mapping.take(frame)
    yield from mapping.flush()
