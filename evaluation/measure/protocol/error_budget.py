"""Error budget: final errors with each stage in turn replaced by the truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import open3d as o3d

from airground.config import Config
from airground.core.cloud import PointCloud
from airground.core.events import BeliefUpdated
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.io.recording import Recording
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.pipeline import locate
from evaluation.measure.protocol.mapping_pass import Maps, map_recording
from evaluation.measure.protocol.trials import refined
from evaluation.setup.setups import Poses, Setup
from evaluation.table.row_writer import RowWriter
from evaluation.table.truth_errors import pose_error, true_T_ground_mav
from sim.recording.truth import Truth


def with_true_surface(sighting: Sighting, truth: Truth) -> Sighting:
    """The aerial surface is the true one in its camera's view, without holes or errors.
    It is placed by the MAV's estimated pose, so that errors of poses stay."""
    surface = sighting.surface
    T_world_camera = truth.T_world_mav_camera(surface.reference_stamp_ns)
    depth = truth.surface("mav").cast(surface.camera, T_world_camera)
    seen = np.isfinite(depth)
    points = surface.camera.rays()[seen] * depth[seen][:, None]
    cloud = PointCloud(
        (surface.T_mav_camera @ points).astype(np.float32),
        np.full((len(points), 3), 128, np.uint8),
    )
    return replace(sighting, surface=replace(surface, depth=depth, cloud_mav=cloud))


def with_true_ground_map(sighting: Sighting, truth: Truth) -> Sighting:
    """Every point of the ground map is moved to the nearest point of the true surface.
    This keeps the coverage, and removes noise and drift across the surfaces."""
    T_world_camera = truth.T_world_ground_camera(sighting.ground_stamp_ns)
    T_world_ground = T_world_camera @ sighting.T_ground_camera.inverse()
    points_world = (T_world_ground @ sighting.ground_cloud.points).astype(np.float32)
    seen = truth.surface("ground").scene
    nearest = seen.compute_closest_points(o3d.core.Tensor.from_numpy(points_world))
    points = T_world_ground.inverse() @ nearest["points"].numpy().astype(np.float64)
    cloud = PointCloud(points.astype(np.float32), sighting.ground_cloud.colours)
    return replace(sighting, ground_cloud=cloud)


def with_true_heading(sighting: Sighting, truth: Truth) -> Sighting:
    """The heading between the maps is the true one."""
    return replace(sighting, heading=true_T_ground_mav(sighting, truth).heading())


STAGE = "budget"
"""Stage of the rows."""
SETTLED = 4
"""Number of the first sighting that counts: the filter converges within 4 (Sec. VIII-C)."""


@dataclass(frozen=True)
class StandIn:
    """One row of the budget.

    Attributes:
        name: Name of the true quantity.
        poses: Source of the poses.
        change: Replaces a stage's result in a sighting; None changes nothing.
        located: Whether refinement starts from the true `T_ground_mav`, without particles.
    """

    name: str
    poses: Poses = "slam"
    change: Callable[[Sighting, Truth], Sighting] | None = None
    located: bool = False


STAND_INS = (
    StandIn("nothing: all estimated"),
    StandIn("the MAV's poses", "slam, exact mav"),
    StandIn("the ground robot's poses", "slam, exact ground"),
    StandIn("both robots' poses", "oracle"),
    StandIn("the aerial surface", change=with_true_surface),
    StandIn("the ground map", change=with_true_ground_map),
    StandIn("the heading", change=with_true_heading),
    StandIn("Monte Carlo localization", located=True),
)


def add_error_budget(
    out: RowWriter,
    recording: Recording,
    truth: Truth,
    setup: Setup,
    maps: Maps,
    seed: tuple[int, int],
) -> None:
    """Write the final error of every sighting under every stand-in, whose name is the rows' note.

    `maps` is the pass under `setup`, which has poses from SLAM; `recording` is mapped again for
    each other source of poses. `seed` has the seed of the recording and the number of the flight;
    stand-ins share random numbers.
    """
    mapped: dict[str, Maps] = {setup.poses: maps}
    for stand_in in STAND_INS:
        if stand_in.poses not in mapped:
            exact = replace(setup, poses=stand_in.poses)
            mapped[stand_in.poses] = map_recording(recording, truth, exact, *seed)
        sightings = mapped[stand_in.poses].sightings
        rng = np.random.default_rng([*seed, 4])
        for trial, error in enumerate(final_errors(sightings, truth, setup.config, stand_in, rng)):
            translation_m, rotation_deg = error
            out.add(STAGE, "translation_m", translation_m, "m", trial=trial, note=stand_in.name)
            out.add(STAGE, "rotation_deg", rotation_deg, "deg", trial=trial, note=stand_in.name)


def final_errors(
    sightings: Sequence[Sighting],
    truth: Truth,
    config: Config,
    stand_in: StandIn,
    rng: np.random.Generator,
) -> list[tuple[float, float]]:
    """Error of the refined pose [m, deg] at each sighting from `SETTLED` on; NaN for failures."""
    localizer = MonteCarloLocalizer(config, rng)
    errors = []
    for iteration, seen in enumerate(sightings, 1):
        sighting = seen if stand_in.change is None else stand_in.change(seen, truth)
        start: SE3 | None = None
        if stand_in.located:
            start = true_T_ground_mav(sighting, truth)
        else:
            for event in locate(localizer, sighting):
                if isinstance(event, BeliefUpdated) and event.belief.converged:
                    start = event.belief.T_ground_mav
        if iteration >= SETTLED:
            errors.append(_refined_error(sighting, start, truth, config))
    return errors


def _refined_error(
    sighting: Sighting, start: SE3 | None, truth: Truth, config: Config
) -> tuple[float, float]:
    """Error of the refined pose [m, deg]; NaN if not located, or not accepted."""
    failed = (float("nan"), float("nan"))
    if start is None:
        return failed
    aligned = refined(sighting, start, config)
    if not aligned.accepted:
        return failed
    error = pose_error(aligned.T_ground_mav, sighting, truth)
    return error.translation_m, error.rotation_deg
