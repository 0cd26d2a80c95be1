"""Finding and aligning an aerial map compiles nothing once warm, and no thread changes it."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from airground.config import Config, Localization, paper
from airground.core.belief import Belief
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.refinement import refine
from airground.warm_up import warm_up_localization, warm_up_mapping, warm_up_refinement
from tests.compiled_kernels import compiled
from tests.localization.synthetic import aerial_points, box_heap, ground_points
from tests.test_pipeline import Recorded

CONFIGS = {
    "best": Config(),
    "paper": paper(),
    "searched": Config(localization=Localization(heading="search", headings=24)),
}
ROOMS = ("airground.localization", "airground.refinement", "airground.core")
CAMERA = np.array([0.2, 0.3, 2.2])

Clouds = tuple[PointCloud, PointCloud]


def cloud(points: np.ndarray) -> PointCloud:
    return PointCloud(np.asarray(points, np.float32), np.zeros((len(points), 3), np.uint8))


@pytest.fixture(scope="module")
def clouds() -> Clouds:
    rng, heap = np.random.default_rng(0), box_heap(1)
    aerial = aerial_points(heap, CAMERA[0], CAMERA[1], rng)
    return cloud(aerial), cloud(ground_points(heap, rng, frames=10))


def localized(config: Config, clouds: Clouds) -> Belief:
    aerial, ground = clouds
    localizer = MonteCarloLocalizer(config, np.random.default_rng(0))
    for stamp in range(2):
        robot = np.array([0.3, 0.0])
        pair = HeightMapPair(stamp, aerial.points, CAMERA, ground.points, robot, 0.0, config)
        list(localizer.update(pair))
    assert localizer.belief is not None
    return localizer.belief


@pytest.mark.parametrize("name", CONFIGS)
def test_nothing_is_compiled_after_the_warm_up(name: str, clouds: Clouds) -> None:
    config = CONFIGS[name]
    warm_up_localization(config, np.random.default_rng(0))
    warm_up_refinement(config)
    before = compiled(*ROOMS)
    assert sum(before.values()) >= 7
    localized(config, clouds)
    refine(0, SE3.identity(), *clouds, config)
    assert compiled(*ROOMS) == before


@pytest.mark.parametrize("name", CONFIGS)
def test_threads_do_not_change_the_result(name: str, clouds: Clouds) -> None:
    results = []
    before = numba.get_num_threads()
    try:
        for threads in sorted({1, before}):
            numba.set_num_threads(threads)
            belief = localized(CONFIGS[name], clouds)
            alignment = refine(0, SE3.identity(), *clouds, CONFIGS[name])
            arrays = belief.particles, belief.T_ground_mav.matrix(), alignment.T_ground_mav.matrix()
            results.append([array.tobytes() for array in arrays])
    finally:
        numba.set_num_threads(before)
    assert results[0] == results[-1]


@pytest.mark.slow
def test_mapping_compiles_nothing_after_the_warm_up() -> None:
    rooms = ("airground.dense", "airground.ground_map", *ROOMS)
    warm_up_mapping(Config(), np.random.default_rng(0))
    before = compiled(*rooms)
    assert sum(before.values()) > 10
    Recorded().run()
    assert compiled(*rooms) == before
