"""Prints digests of what the kernels make of fixed data; a program of its own.

Run twice with the same folder for numba's cache, the first compiles and the second loads.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from airground.config import Config, Localization, paper
from airground.core.events import BeliefUpdated, DepthMapMade, Event, SurfaceCast
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.pipeline import Mapping, locate
from airground.refinement import refine
from airground.tracking import FrontEnds
from tests.slam import bundle_problems
from tests.slam.test_bundle_adjustment import run as adjusted
from tests.test_pipeline import CALIBRATION, T_WORLD_MAV, Known, Recorded


def digest(*arrays: ArrayLike) -> str:
    made = hashlib.sha256()
    for array in arrays:
        made.update(np.ascontiguousarray(array).tobytes())
    return made.hexdigest()[:16]


def mapped(recorded: Recorded) -> Iterator[tuple[str, Sighting | None]]:
    """Depth maps, surfaces and the ground map; a sighting with each surface."""
    mapping = Mapping(Config(), CALIBRATION["mav"], CALIBRATION["ground"])
    events: list[Event] = []
    for frame in recorded.frames(FrontEnds(Known(recorded.mav), Known(recorded.ground))):
        events += mapping.take(frame)
    events += mapping.flush()
    for event in events:
        if isinstance(event, DepthMapMade):
            yield f"depth map {digest(event.depth_map.depth)}", None
        if isinstance(event, SurfaceCast):
            cloud = event.surface.cloud_mav
            line = f"surface {digest(event.surface.depth, cloud.points, cloud.normals)}"
            yield line, mapping.sight(event.surface)
    cloud = mapping.ground_cloud()
    yield f"ground map {digest(cloud.points, cloud.colours, cloud.normals)}", None


def found(sighting: Sighting, config: Config) -> Iterator[str]:
    """Three updates by the same sighting, and a refinement."""
    localizer = MonteCarloLocalizer(config, np.random.default_rng(0))
    for _ in range(3):
        for event in locate(localizer, sighting):
            if isinstance(event, BeliefUpdated):
                belief = event.belief
                yield f"belief {digest(belief.particles, belief.T_ground_mav.matrix())}"
    surface = sighting.surface
    start = SE3.from_heading(0.02, (0.05, 0.1, 0.02)) @ T_WORLD_MAV
    alignment = refine(0, start, surface.cloud_mav, sighting.ground_cloud, config)
    yield f"alignment {digest(alignment.T_ground_mav.matrix())}"


def optimized() -> str:
    """A bundle of visual, depth and inertial measurements."""
    problem = bundle_problems.make(6, 40, 30, seed=1, noise=True, depth=True, inertial=True)
    roles = bundle_problems.fixed(problem.states, 2)
    states, points = bundle_problems.perturbed(problem, roles)
    result = adjusted(problem, roles, states, points)
    return f"bundle {digest(result.states.positions, result.states.rotations, result.points)}"


def main() -> None:
    sightings = []
    for line, sighting in mapped(Recorded()):
        print(line)
        sightings += [sighting] if sighting is not None else []
    searched = Config(localization=Localization(heading="search", headings=36))
    for config in (Config(), paper(), searched):
        for line in found(sightings[-1], config):
            print(line)
    print(optimized())


if __name__ == "__main__":
    main()
