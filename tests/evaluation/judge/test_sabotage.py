"""Sabotage that a check must flag, on made-up heaps.

The clouds are ray-cast with the noise of their sensors; localization, its metrics and the
verdict are the product's own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pytest

from airground.config import Config, Localization
from airground.core.arrays import F32, Floats
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import AerialSurface
from airground.localization import channels, height_map_pair
from airground.localization.channel_kernels import GROUND
from airground.localization.particle_filter import MonteCarloLocalizer
from evaluation.judge.accepted import Measured
from evaluation.judge.verdict import Comparison, Verdict, compare
from evaluation.measure.protocol.trials import localize_sequence
from evaluation.measure.protocol.wide_search import add_wide_searches
from evaluation.setup.condition import Condition
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from tests.localization.synthetic import aerial_points, box_heap, ground_points

pytestmark = pytest.mark.slow

CONDITION = Condition("best", "synthetic", "nominal", "known")
# More than the suite flies: in a third of these heaps no wide search goes wrong without the
# overlap rule.
FLIGHTS, LENGTH, SEQUENCES, SEARCHES = 20, 4, 3, 6
DOWN = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
TINY_CAMERA = PinholeCamera(2, 2, 1.0, 1.0, 0.5, 0.5)
T_WORLD_MAV = SE3(SE3.from_heading(0.7).rotation, np.array([1.5, -0.4, 0.3]))
"""Where the MAV began; the frame `ground` is the world's."""


@dataclass(frozen=True)
class HeapTruth:
    """Where the cameras were, by stamp."""

    mav: dict[int, SE3]

    def T_world_mav_camera(self, stamp_ns: int) -> SE3:
        return self.mav[stamp_ns]

    def T_world_ground_camera(self, stamp_ns: int) -> SE3:
        return SE3.identity()


@dataclass(frozen=True)
class Flown:
    seed: int
    sightings: list[Sighting]
    truth: HeapTruth


def fly(seed: int) -> Flown:
    """A flight of a few aerial maps along the corridor of a heap."""
    rng = np.random.default_rng([seed, 3])
    heap = box_heap(seed)
    ground = _cloud(ground_points(heap, rng, frames=60))
    sightings, poses = [], {}
    for stamp in range(LENGTH + SEQUENCES - 1):
        x, y = -1.2 + 0.5 * stamp, rng.uniform(-0.4, 0.4)
        T_world_camera = SE3(DOWN, np.array([x, y, 2.2]))
        T_mav_camera = T_WORLD_MAV.inverse() @ T_world_camera
        points = T_WORLD_MAV.inverse() @ aerial_points(heap, x, y, rng)[::3]
        surface = AerialSurface(
            stamp,
            stamp,
            TINY_CAMERA,
            T_mav_camera,
            np.full((2, 2), np.nan, np.float32),
            _cloud(points.astype(np.float32)),
            5,
        )
        heading = 0.7 + np.deg2rad(rng.normal(0, 1.0))
        sightings.append(
            Sighting(surface, ground, stamp, T_mav_camera, stamp, SE3.identity(), heading)
        )
        poses[stamp] = T_world_camera
    return Flown(seed, sightings, HeapTruth(poses))


def _cloud(points: np.ndarray) -> PointCloud:
    return PointCloud(points, np.zeros((len(points), 3), np.uint8))


def measure(flown: Sequence[Flown]) -> Measured:
    rows = []
    for flight in flown:
        out = RowWriter("heap", flight.seed, 0, CONDITION)
        for sequence in range(SEQUENCES):
            rng = np.random.default_rng([flight.seed, sequence])
            part = flight.sightings[sequence : sequence + LENGTH]
            iteration = 0
            steps = localize_sequence(part, flight.truth, Config(), rng)  # type: ignore[arg-type]
            for _, _, result in steps:
                if result is not None:
                    iteration += 1
                    distance = result.squared_mahalanobis
                    out.add_belief(result.belief, result.error, distance, sequence, iteration)
        seed = (flight.seed, 0)
        add_wide_searches(out, flight.sightings, flight.truth, Config(), seed, SEARCHES)  # type: ignore[arg-type]
        rows += out.rows
    return Measured.of(ResultTable.from_rows(rows))


@pytest.fixture(scope="module")
def flown() -> list[Flown]:
    return [fly(seed) for seed in range(FLIGHTS)]


@pytest.fixture(scope="module")
def clean(flown: list[Flown]) -> Measured:
    return measure(flown)


def worse(comparison: Comparison) -> set[str]:
    return {judged.metric.name for judged in comparison.of(Verdict.WORSE)}


def test_the_unchanged_program_is_not_flagged(flown: list[Flown], clean: Measured) -> None:
    comparison = compare(clean, measure(flown))
    assert {judged.verdict for judged in comparison.judged} <= {Verdict.SAME, Verdict.UNMEASURED}


def shift_by_two_cells(patch: pytest.MonkeyPatch) -> None:
    original = height_map_pair.ground_height_map

    def shifted(*args: object) -> object:
        made = original(*args)  # type: ignore[arg-type]
        return replace(made, origin=made.origin + 2 / made.cells_per_m)

    patch.setattr(height_map_pair, "ground_height_map", shifted)


def forget_the_overlap(patch: pytest.MonkeyPatch) -> None:
    """Neither its rule nor its weight: without the rule alone, small overlaps count little."""
    original = channels.costs_of

    def costs_of(sums: Floats, _: int, cells_per_m: float, config: Localization) -> F32:
        overlap_m2 = np.maximum(sums[:, GROUND:].sum(axis=1), 1) / cells_per_m**2
        return (original(sums, 0, cells_per_m, config) / overlap_m2).astype(np.float32)

    patch.setattr(channels, "costs_of", costs_of)


def freeze_the_particles(patch: pytest.MonkeyPatch) -> None:
    """Neither moved nor drawn anew."""
    for name in ("_move", "_redraw"):
        patch.setattr(MonteCarloLocalizer, name, lambda _, particles, *rest: particles.copy())


@pytest.mark.parametrize(
    "sabotage",
    [shift_by_two_cells, freeze_the_particles, forget_the_overlap],
)
def test_sabotaged_localization_is_flagged(
    sabotage: Callable[[pytest.MonkeyPatch], None],
    flown: list[Flown],
    clean: Measured,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sabotage(monkeypatch)
    assert worse(compare(clean, measure(flown)))


def test_ray_length_as_depth_is_flagged(flown: list[Flown], clean: Measured) -> None:
    stretched = [
        replace(flight, sightings=[_stretched(sighting) for sighting in flight.sightings])
        for flight in flown
    ]
    assert worse(compare(clean, measure(stretched)))


def _stretched(sighting: Sighting) -> Sighting:
    """What is seen if a depth holds the length of the ray."""
    surface = sighting.surface
    points = surface.T_mav_camera.inverse() @ surface.cloud_mav.points
    lengths = np.linalg.norm(points, axis=1, keepdims=True) / points[:, 2:]
    wrong = (surface.T_mav_camera @ (points * lengths)).astype(np.float32)
    return replace(sighting, surface=replace(surface, cloud_mav=_cloud(wrong)))
