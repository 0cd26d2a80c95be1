"""Gathers the data behind the pictures of one flight, while the flight is run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from airground.augmentation import AugmentedMap
from airground.core.belief import Belief, CostMap
from airground.core.cloud import PointCloud, Source
from airground.core.events import (
    Aligned,
    BeliefUpdated,
    CostMapComputed,
    DepthMapMade,
    FieldAdded,
    HeightMapsMade,
    SurfaceCast,
)
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import DepthMap
from airground.core.trajectory import Trajectory
from airground.io.recording import Recording
from airground.localization.hypotheses import search_headings, search_positions
from airground.refinement import refine
from evaluation.measure.baselines.matched_images import match_images
from evaluation.measure.protocol.trials import noisy_start, spread_evenly
from evaluation.measure.showcase import LocalizationStep, Showcase
from evaluation.run.onlooker import Seen
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import Tracked
from evaluation.table.truth_errors import depth_error, true_T_ground_mav
from sim.recording.truth import Truth

PANELS = 3
"""Aerial maps in Fig. 8, and single depth maps in Fig. 6: as many as fit side by side."""


class CloseUp:
    """An onlooker that keeps the first aerial maps of a run, from depth maps to particles."""

    def __init__(self, recording: Recording, truth: Truth, setup: Setup) -> None:
        self._recording, self._truth, self._setup = recording, truth, setup
        self._depth_maps: dict[int, DepthMap] = {}
        self._fused: list[DepthMap] = []
        self._heights: HeightMapsMade | None = None
        self._cost_map: CostMap | None = None
        self._first: tuple[Sighting, HeightMapsMade] | None = None
        self._first_alignment: Aligned | None = None
        self._steps: list[LocalizationStep] = []
        self._T_ground_mav: SE3 | None = None

    def see(self, seen: Seen) -> None:
        """Keep what belongs to the first aerial maps, and the newest alignment."""
        event = seen.event
        if isinstance(event, Aligned):
            if len(self._steps) == 1:
                self._first_alignment = event
            if event.alignment.accepted:
                self._T_ground_mav = event.alignment.T_ground_mav
        if not self._steps:
            self._keep_depth(seen)
        if len(self._steps) < PANELS:
            self._keep_localization(seen)

    def showcase(
        self, tracked: dict[str, Tracked], augmented: AugmentedMap, match_seed: int | None = None
    ) -> Showcase | None:
        """The data gathered, after the run; None if no aerial map was located.
        `match_seed` is that of the prior pose that chooses ground views for matches by ASIFT; None
        leaves out the matches, which take seconds."""
        if self._first is None:
            return None
        sighting, heights = self._first
        surface, truth = sighting.surface, self._truth
        chosen = [self._fused[i] for i in spread_evenly(len(self._fused), PANELS)]
        T_ground_mav = self._T_ground_mav or self._steps[-1].belief.T_ground_mav
        cloud, sources = augmented.cloud_ground, augmented.sources
        kept = Showcase(
            scene=self._recording.scene,
            condition=self._setup.condition(self._recording.sensors).label(),
            depth_maps=tuple(chosen),
            depth_errors=tuple(depth_error(d.depth, d.camera, d.stamp_ns, truth) for d in chosen),
            surface=surface,
            surface_error=depth_error(
                surface.depth, surface.camera, surface.reference_stamp_ns, truth
            ),
            aerial_heights=heights.aerial,
            ground_heights=heights.ground,
            steps=tuple(self._steps),
            ground_cloud=_part(cloud, sources == Source.GROUND),
            aerial_cloud=_part(cloud, sources == Source.MAV),
            mav_path=_path(tracked["mav"], T_ground_mav),
            ground_path=_path(tracked["ground"], SE3.identity()),
            mav_image=self._recording.mav.image_at(surface.reference_stamp_ns).image,
            ground_image=self._recording.ground.image_at(sighting.ground_stamp_ns).colour,
            T_ground_mav=self._refined(sighting),
        )
        if match_seed is None:
            return kept
        prior = noisy_start(
            true_T_ground_mav(sighting, truth),
            sighting.T_mav_camera,
            np.random.default_rng([match_seed, 6]),
        )
        ground_poses = tracked["ground"].front_end.live_poses()
        return replace(kept, matched=match_images(self._recording, ground_poses, sighting, prior))

    def _keep_depth(self, seen: Seen) -> None:
        """Depth maps of the surface that is under construction."""
        match seen.event:
            case DepthMapMade(depth_map=made):
                self._depth_maps[made.stamp_ns] = made
            case FieldAdded(reference_stamp_ns=stamp_ns):
                self._fused.append(self._depth_maps.pop(stamp_ns))
            case SurfaceCast(surface=surface):
                self._fused = self._fused[-surface.depth_maps :]

    def _keep_localization(self, seen: Seen) -> None:
        match seen.event:
            case HeightMapsMade():
                self._heights, self._cost_map = seen.event, None
            case CostMapComputed(cost_map=cost_map):
                self._cost_map = cost_map
            case BeliefUpdated(belief=belief) if seen.sighting is not None:
                assert self._heights is not None
                if self._first is None:
                    self._first = seen.sighting, self._heights
                self._steps.append(self._step(belief, seen.sighting, self._heights))

    def _step(
        self, belief: Belief, sighting: Sighting, heights: HeightMapsMade
    ) -> LocalizationStep:
        true = true_T_ground_mav(sighting, self._truth)
        true_u = (true @ sighting.surface.T_mav_camera.translation)[:2]
        cost_map = self._cost_map or self._whole_cost_map(sighting, heights)
        return LocalizationStep(cost_map, belief, true_u)

    def _whole_cost_map(self, sighting: Sighting, heights: HeightMapsMade) -> CostMap:
        """The cost of every position; the filter itself computes it for the first map only."""
        local = self._setup.config.localization
        at = heights.aerial, heights.ground, sighting.T_ground_camera.translation[:2]
        if local.heading == "search":
            return search_headings(*at, local).cost_map(local.cost)
        return search_positions(*at, sighting.heading or 0.0, local).cost_map(local.cost)

    def _refined(self, sighting: Sighting) -> SE3 | None:
        """Alignment of the first surface; of a belief that did not converge, computed here."""
        if self._first_alignment is not None:
            alignment = self._first_alignment.alignment
        else:
            surface, start = sighting.surface, self._steps[0].belief.T_ground_mav
            clouds = surface.cloud_mav, sighting.ground_cloud
            alignment = refine(surface.stamp_ns, start, *clouds, self._setup.config)
        return alignment.T_ground_mav if alignment.accepted else None


def _part(cloud: PointCloud, chosen: np.ndarray) -> PointCloud:
    return PointCloud(cloud.points[chosen], cloud.colours[chosen])


def _path(tracked: Tracked, T_ground_map: SE3) -> Trajectory:
    """Live poses of a robot's camera, in `ground`."""
    poses = tracked.front_end.live_poses()
    return Trajectory.from_poses(
        [stamp for stamp, _ in poses], [T_ground_map @ pose for _, pose in poses]
    )
