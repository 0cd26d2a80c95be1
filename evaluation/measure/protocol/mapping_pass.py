"""One pass of the pipeline over a recording, kept for the protocol.

Sequences, trials, negative cases, baselines and pictures start from the sightings of this pass.
The first sequence of a flight is the pipeline's own; all others repeat its sightings.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

from airground.augmentation import AugmentedMap
from airground.core.belief import Alignment, Belief
from airground.core.cloud import PointCloud
from airground.core.events import (
    Aligned,
    BeliefUpdated,
    CostMapComputed,
    DepthMapMade,
    Event,
    FieldAdded,
    HeightMapsMade,
    MapAugmented,
    Sighted,
    SurfaceCast,
)
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import DepthMap
from airground.io.recording import Recording
from evaluation.run.driver import drive, pipeline_for
from evaluation.run.drops import SCHEMA, DropList, Stamps, fingerprint
from evaluation.run.onlooker import STAGE_OF, Onlooker, Seen, timed
from evaluation.run.tracking import TrackingHere, TrackingTask, localizer_rng
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import Tracked
from sim.recording.truth import Truth

LOCALIZATION = (HeightMapsMade, CostMapComputed, BeliefUpdated, Aligned, MapAugmented)
"""Events after a sighting: setups that differ in these alone share their maps."""


def _by_stage() -> dict[str, list[float]]:
    return defaultdict(list)


@dataclass
class Localized:
    """Beliefs and alignments of the pipeline for its sightings.

    Attributes:
        beliefs: Belief after each sighting.
        alignments: Alignment of each sighting; None where no position was claimed.
        durations_ms: Durations of localization, refinement and augmentation, by stage [ms].
    """

    beliefs: list[Belief] = field(default_factory=list)
    alignments: list[Alignment | None] = field(default_factory=list)
    durations_ms: dict[str, list[float]] = field(default_factory=_by_stage)

    def take(self, event: Event, duration_ms: float) -> None:
        """Keep the result and the duration of an event after a sighting."""
        if isinstance(event, LOCALIZATION):
            self.durations_ms[STAGE_OF[type(event)]].append(duration_ms)
        match event:
            case BeliefUpdated():
                self.beliefs.append(event.belief)
                self.alignments.append(None)
            case Aligned():
                self.alignments[-1] = event.alignment

    def total_s(self) -> float:
        """Time of all stages together [s]."""
        return 1e-3 * sum(sum(durations) for durations in self.durations_ms.values())


@dataclass
class Maps:
    """Outcome of one pass; an onlooker of that pass.

    Attributes:
        sightings: One per aerial surface that could be located, in order of time.
        depth_maps: Depth maps that were fused for each sighting.
        localized: The pipeline's own beliefs and alignments.
        durations_ms: Durations of the stages up to the surface, by stage [ms].
        tracked: Answers of the front ends, by robot ("mav", "ground").
        augmented: The augmented map at the end of the pass.
        mapping_s: Wall time of the pass without localization, decoding included [s].
    """

    sightings: list[Sighting] = field(default_factory=list)
    depth_maps: list[list[DepthMap]] = field(default_factory=list)
    localized: Localized = field(default_factory=Localized)
    durations_ms: dict[str, list[float]] = field(default_factory=_by_stage)
    tracked: dict[str, Tracked] = field(default_factory=dict)
    augmented: AugmentedMap | None = None
    mapping_s: float = 0.0
    _made: dict[int, DepthMap] = field(default_factory=dict)
    _fused: list[DepthMap] = field(default_factory=list)
    _of_surface: list[DepthMap] = field(default_factory=list)

    def see(self, seen: Seen) -> None:
        """Keep the result and the duration of an event."""
        event = seen.event
        self.localized.take(event, seen.duration_ms)
        if type(event) in STAGE_OF and not isinstance(event, LOCALIZATION):
            self.durations_ms[STAGE_OF[type(event)]].append(seen.duration_ms)
        match event:
            case DepthMapMade():
                self._made[event.depth_map.stamp_ns] = event.depth_map
            case FieldAdded():
                self._fused.append(self._made.pop(event.reference_stamp_ns))
            case SurfaceCast():
                self._of_surface, self._fused = self._fused, []
            case Sighted():
                self.sightings.append(event.sighting)
                self.depth_maps.append(self._of_surface)


def map_recording(
    recording: Recording,
    truth: Truth,
    setup: Setup,
    seed: int,
    flight: int = 0,
    onlookers: Sequence[Onlooker] = (),
) -> Maps:
    """Run the pipeline of Figure 4 over a whole recording, each frame tracked in turn.
    The pipeline is seeded by the recording's `seed` and the number of its `flight`; `truth` gives
    the oracles their poses; `onlookers` see every event."""
    maps = Maps()
    tracking = TrackingHere(TrackingTask(recording, truth, setup, seed), ahead=0)
    pipeline = pipeline_for(recording, setup, localizer_rng(seed, flight))
    driven = drive(recording, tracking, pipeline, setup, [maps, *onlookers])
    maps.tracked, maps.augmented = driven.tracked, pipeline.augmented_map()
    maps.mapping_s = driven.processing_s - maps.localized.total_s()
    return maps


def localize_again(
    maps: Maps, recording: Recording, setup: Setup, seed: int, flight: int
) -> Localized:
    """Beliefs and alignments for the same sightings under a setup with the same maps. They equal
    those of a pass of its own (`map_recording`), since localization does not act on the maps."""
    pipeline = pipeline_for(recording, setup, localizer_rng(seed, flight))
    localized = Localized()
    for sighting in maps.sightings:
        for event, duration_ms in timed(pipeline.locate_and_augment(sighting)):
            localized.take(event, duration_ms)
    return localized


@dataclass(frozen=True, eq=False)
class GroundPass:
    """Map of a ground robot alone: its final cloud, and its last camera pose."""

    cloud_ground: PointCloud
    T_ground_camera: SE3


def map_ground(recording: Recording, truth: Truth, setup: Setup, seed: int) -> GroundPass | None:
    """A ground robot's map without the MAV's images; None if the robot never had a pose."""
    no_aerial = DropList(
        schema=SCHEMA,
        recording=fingerprint(recording),
        dropped=Stamps(mav=frozenset(recording.mav.camera_stamps.tolist())),
    )
    tracking = TrackingHere(TrackingTask(recording, truth, setup, seed, no_aerial), ahead=0)
    pipeline = pipeline_for(recording, setup, localizer_rng(seed, recording.flight))
    driven = drive(recording, tracking, pipeline, setup, [])
    live = driven.tracked["ground"].front_end.live_poses()
    if not live:
        return None
    return GroundPass(pipeline.mapping.ground_cloud(), live[-1][1])
