"""Picks one stretch of a flight and gathers what the report's pictures are drawn from."""

from __future__ import annotations

import numpy as np

from airground.augmentation import Augmentation
from airground.config import Config
from airground.core.belief import CostMap, HeightMap
from airground.core.cloud import PointCloud, Source
from airground.core.events import HeightMapsMade
from airground.core.se3 import SE3
from airground.core.surface import DepthMap
from airground.core.trajectory import Trajectory
from airground.io.recording import Recording
from airground.localization.hypotheses import search_headings, search_positions
from airground.pipeline import Sighting
from airground.refinement import refine
from evaluation.measure.baselines.matched_images import MatchedImages, match_images
from evaluation.measure.protocol.mapping_pass import Maps
from evaluation.measure.protocol.trials import (
    SEQUENCE_LENGTH,
    localize_sequence,
    noisy_start,
    sequence_starts,
)
from evaluation.measure.showcase.showcase import LocalizationStep, Showcase
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import Tracked
from evaluation.table.truth_errors import depth_error, true_T_ground_mav
from sim.recording.truth import Truth

PANELS = 3
"""Aerial maps in Fig. 8, and depth maps in Fig. 6."""


def make_showcase(
    recording: Recording, truth: Truth, maps: Maps, setup: Setup, seed: int, match: bool = False
) -> Showcase | None:
    """The middle of a flight, from depth maps to the augmented map; None if nothing was seen.

    With `match` also what ASIFT finds between both robots' images, which takes seconds.
    """
    if not maps.sightings:
        return None
    starts = sequence_starts(len(maps.sightings), 3)
    first = starts[len(starts) // 2]
    sightings = maps.sightings[first : first + SEQUENCE_LENGTH]
    shown = sightings[0]
    surface = shown.surface
    heights, steps = _localization_steps(sightings[:PANELS], truth, setup.config, seed)
    aerial_cloud, T_ground_mav = _augmented(sightings, steps[-1].belief.T_ground_mav, setup.config)
    chosen = spread_out(maps.depth_maps[first], PANELS)
    start = steps[0].belief.T_ground_mav
    refined = refine(surface.stamp_ns, start, surface.cloud_mav, shown.ground_cloud, setup.config)
    return Showcase(
        scene=recording.scene,
        condition=setup.condition(recording.sensors).label(),
        depth_maps=tuple(chosen),
        depth_errors=tuple(depth_error(d.depth, d.camera, d.stamp_ns, truth) for d in chosen),
        surface=surface,
        surface_error=depth_error(surface.depth, surface.camera, surface.reference_stamp_ns, truth),
        aerial_heights=heights.aerial,
        ground_heights=heights.ground,
        aerial_reference=np.zeros(2),
        aerial_heading=0.0,
        steps=tuple(steps),
        ground_cloud=sightings[-1].ground_cloud,
        aerial_cloud=aerial_cloud,
        mav_path=path_in_ground(maps.tracked["mav"], T_ground_mav),
        ground_path=path_in_ground(maps.tracked["ground"], SE3.identity()),
        mav_image=recording.mav_image_at(surface.reference_stamp_ns).image,
        ground_image=recording.ground_image_at(shown.ground_stamp_ns).colour,
        matched=_matched(recording, truth, maps, shown, seed) if match else None,
        T_ground_mav=refined.T_ground_mav if refined.accepted else None,
    )


def _matched(
    recording: Recording, truth: Truth, maps: Maps, sighting: Sighting, seed: int
) -> MatchedImages | None:
    """With ground views chosen by a prior as noisy as those of the baselines."""
    true = true_T_ground_mav(sighting, truth)
    prior = noisy_start(true, sighting.T_mav_camera, np.random.default_rng([seed, 6]))
    poses = maps.tracked["ground"].front_end.live_poses()
    return match_images(recording, poses, sighting, prior)


def _localization_steps(
    sightings: list[Sighting], truth: Truth, config: Config, seed: int
) -> tuple[HeightMapsMade, list[LocalizationStep]]:
    """The first aerial maps of a fresh filter, each with its whole cost map behind it."""
    rng = np.random.default_rng([seed, 3])
    made: list[HeightMapsMade] = []
    steps: list[LocalizationStep] = []
    for event, _, iteration in localize_sequence(sightings, truth, config, rng):
        if isinstance(event, HeightMapsMade):
            made.append(event)
        if iteration is not None:
            sighting = sightings[len(steps)]
            true = true_T_ground_mav(sighting, truth)
            true_u = (true @ sighting.surface.T_mav_camera.translation)[:2]
            cost_map = whole_cost_map(made[-1].aerial, made[-1].ground, sighting, config)
            steps.append(LocalizationStep(cost_map, iteration.belief, true_u))
    return made[0], steps


def whole_cost_map(
    aerial: HeightMap, ground: HeightMap, sighting: Sighting, config: Config
) -> CostMap:
    """The cost of every position around the ground robot."""
    centre = sighting.T_ground_camera.translation[:2]
    local = config.localization
    if local.heading == "search":
        return search_headings(aerial, ground, centre, local).cost_map(local.cost)
    heading = sighting.heading or 0.0
    return search_positions(aerial, ground, centre, heading, local).cost_map(local.cost)


def _augmented(
    sightings: list[Sighting], T_ground_mav: SE3, config: Config
) -> tuple[PointCloud, SE3]:
    """What the accepted alignments add to the ground map, and the newest of them."""
    augmentation = Augmentation(config.ground_mapping.voxel_m)
    for sighting in sightings:
        surface, ground = sighting.surface, sighting.ground_cloud
        alignment = refine(surface.stamp_ns, T_ground_mav, surface.cloud_mav, ground, config)
        if alignment.accepted:
            T_ground_mav = alignment.T_ground_mav
            augmentation.add(surface, T_ground_mav)
    augmented = augmentation.map(PointCloud.empty())
    aerial = augmented.sources == Source.MAV
    cloud = augmented.cloud_ground
    return PointCloud(cloud.points[aerial], cloud.colours[aerial]), T_ground_mav


def spread_out(depth_maps: list[DepthMap], count: int) -> list[DepthMap]:
    """Some of them, over their whole time."""
    chosen = np.linspace(0, len(depth_maps) - 1, min(count, len(depth_maps))).round().astype(int)
    return [depth_maps[i] for i in chosen]


def path_in_ground(tracked: Tracked, T_ground_map: SE3) -> Trajectory:
    """Live poses, in `ground`."""
    poses = tracked.front_end.live_poses()
    return Trajectory.from_poses(
        [stamp for stamp, _ in poses], [T_ground_map @ pose for _, pose in poses]
    )
