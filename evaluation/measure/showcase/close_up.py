"""Gathers what the report's pictures are drawn from, while a recording is run."""

from __future__ import annotations

import numpy as np

from airground.core.belief import Belief, CostMap
from airground.core.cloud import PointCloud, Source
from airground.core.events import (
    Aligned,
    BeliefUpdated,
    CostMapComputed,
    DepthMapMade,
    FieldAdded,
    HeightMapsMade,
)
from airground.core.se3 import SE3
from airground.core.surface import DepthMap
from airground.io.recording import Recording
from airground.pipeline import Sighting
from evaluation.measure.showcase.maker import PANELS, path_in_ground, spread_out, whole_cost_map
from evaluation.measure.showcase.showcase import LocalizationStep, Showcase
from evaluation.run.onlooker import Seen
from evaluation.run.recording import RunResult
from evaluation.setup.setups import Setup
from evaluation.table.truth_errors import depth_error, true_T_ground_mav
from sim.recording.truth import Truth


class CloseUp:
    """An onlooker that keeps the first aerial maps of a run, from depth maps to particles.

    Args:
        recording: What is run.
        truth: What is true.
        setup: How the pipeline is set.
    """

    def __init__(self, recording: Recording, truth: Truth, setup: Setup) -> None:
        self._recording, self._truth, self._setup = recording, truth, setup
        self._depth_maps: dict[int, DepthMap] = {}
        self._fused: list[DepthMap] = []
        self._heights: list[HeightMapsMade] = []
        self._cost_map: CostMap | None = None
        self._sightings: list[Sighting] = []
        self._steps: list[LocalizationStep] = []
        self._refined: SE3 | None = None

    def see(self, seen: Seen) -> None:
        """Keep what belongs to the first aerial maps."""
        if len(self._steps) == PANELS:
            return
        match seen.event:
            case DepthMapMade(depth_map=made) if not self._steps:
                self._depth_maps[made.stamp_ns] = made
            case FieldAdded(reference_stamp_ns=stamp_ns) if not self._steps:
                self._fused.append(self._depth_maps.pop(stamp_ns))
            case HeightMapsMade():
                self._heights.append(seen.event)
                self._cost_map = None
            case CostMapComputed(cost_map=cost_map):
                self._cost_map = cost_map
            case BeliefUpdated(belief=belief) if seen.sighting is not None:
                self._sightings.append(seen.sighting)
                self._steps.append(self._step(belief, seen.sighting))
            case Aligned(alignment=alignment) if len(self._steps) == 1 and alignment.accepted:
                self._refined = alignment.T_ground_mav

    def showcase(self, result: RunResult) -> Showcase | None:
        """What was kept, with the map that the run left; None if nothing was located."""
        if not self._steps:
            return None
        shown = self._sightings[0]
        surface, truth = shown.surface, self._truth
        chosen = spread_out(self._fused[-surface.depth_maps :], PANELS)
        T_ground_mav = result.T_ground_mav or self._steps[-1].belief.T_ground_mav
        cloud, sources = result.augmented.cloud_ground, result.augmented.sources
        return Showcase(
            scene=self._recording.scene,
            condition=self._setup.condition(self._recording.sensors).label(),
            depth_maps=tuple(chosen),
            depth_errors=tuple(depth_error(d.depth, d.camera, d.stamp_ns, truth) for d in chosen),
            surface=surface,
            surface_error=depth_error(
                surface.depth, surface.camera, surface.reference_stamp_ns, truth
            ),
            aerial_heights=self._heights[0].aerial,
            ground_heights=self._heights[0].ground,
            aerial_reference=np.zeros(2),
            aerial_heading=0.0,
            steps=tuple(self._steps),
            ground_cloud=_part(cloud, sources == Source.GROUND),
            aerial_cloud=_part(cloud, sources == Source.MAV),
            mav_path=path_in_ground(result.tracked["mav"], T_ground_mav),
            ground_path=path_in_ground(result.tracked["ground"], SE3.identity()),
            mav_image=self._recording.mav_image_at(surface.reference_stamp_ns).image,
            ground_image=self._recording.ground_image_at(shown.ground_stamp_ns).colour,
            T_ground_mav=self._refined,
        )

    def _step(self, belief: Belief, sighting: Sighting) -> LocalizationStep:
        true = true_T_ground_mav(sighting, self._truth)
        true_u = (true @ sighting.surface.T_mav_camera.translation)[:2]
        made, cost_map = self._heights[-1], self._cost_map
        if cost_map is None:
            cost_map = whole_cost_map(made.aerial, made.ground, sighting, self._setup.config)
        return LocalizationStep(cost_map, belief, true_u)


def _part(cloud: PointCloud, chosen: np.ndarray) -> PointCloud:
    return PointCloud(cloud.points[chosen], cloud.colours[chosen])
