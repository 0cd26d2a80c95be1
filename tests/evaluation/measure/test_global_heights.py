"""Searches of height maps at any heading, in worlds where the answer is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.core.belief import HeightMap
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.pipeline import pair_of
from evaluation.measure.baselines import gradient_particles as gradients
from evaluation.measure.baselines import scan_context as context
from evaluation.measure.baselines.gradient_particles import Slopes, clustered, gradient_particles
from evaluation.measure.baselines.height_search import ncc_search, zmssd_search
from evaluation.measure.baselines.interface import Given
from evaluation.measure.baselines.scan_context import (
    RINGS,
    SECTORS,
    PolarGrid,
    allowed_turns,
    scan_context,
)
from evaluation.setup.setups import with_localization
from tests.evaluation.measure.closed_worlds import (
    T_GROUND_MAV,
    bare_floor,
    boxes_on_floor,
    error_of,
    given_of,
)

BOTH = pytest.mark.parametrize("locate", [scan_context, gradient_particles])


def turned(given: Given, turn: float) -> Given:
    """The same world, the MAV's map turned about its origin, and no heading known."""
    surface = given.sighting.surface
    T = SE3.from_heading(turn)
    cloud = PointCloud(
        (T @ surface.cloud_mav.points.astype(np.float64)).astype(np.float32),
        surface.cloud_mav.colours,
    )
    moved = replace(surface, T_mav_camera=T @ surface.T_mav_camera, cloud_mav=cloud)
    return replace(given, sighting=replace(given.sighting, surface=moved, heading=None))


@pytest.mark.parametrize(
    ("locate", "most_deg"),
    # Cells of 5 cm tell small turns of a map of 2 m apart by their few pixels at the edges alone.
    [(scan_context, 1.1), (gradient_particles, 1.1), (zmssd_search, 3.0), (ncc_search, 3.0)],
)
@pytest.mark.parametrize("turn", [0.0, 1.9, -2.8])
def test_the_place_is_found_at_any_heading(locate, most_deg: float, turn: float) -> None:  # type: ignore[no-untyped-def]
    given = given_of(boxes_on_floor())
    answer = locate(turned(given, turn))
    assert answer.claimed, answer.refusal
    off_m, off_deg = error_of(answer.T_ground_mav @ SE3.from_heading(turn), given)
    assert off_m < 0.06
    assert off_deg < most_deg


@BOTH
def test_a_known_heading_rules_out_other_turns(locate) -> None:  # type: ignore[no-untyped-def]
    """With a heading that is wrong by 90 degrees the answer is turned by about as much."""
    given = given_of(boxes_on_floor())
    heading = T_GROUND_MAV.heading() + np.pi / 2
    wrong = replace(given, sighting=replace(given.sighting, heading=heading))
    answer = locate(wrong)
    if answer.T_ground_mav is not None:
        assert abs(answer.T_ground_mav.heading() - heading) < np.deg2rad(30)


@BOTH
def test_flat_ground_is_abstained_from(locate) -> None:  # type: ignore[no-untyped-def]
    answer = locate(given_of(bare_floor()))
    assert not answer.claimed


@BOTH
def test_same_seed_same_answer(locate) -> None:  # type: ignore[no-untyped-def]
    points = boxes_on_floor()
    first, second = (locate(given_of(points)).T_ground_mav.matrix() for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_particles_do_not_claim_one_of_two_places_alike() -> None:
    points = boxes_on_floor()
    near = points[np.abs(points[:, 0]) < 1.25]
    given = given_of(points)
    aside = np.array([1.25, 0.0, 0.0])
    twice = np.concatenate([near - aside, near + aside]).astype(np.float32)
    ground = PointCloud(twice, np.zeros((len(twice), 3), np.uint8))
    answer = gradient_particles(
        replace(given, sighting=replace(given.sighting, ground_cloud=ground))
    )
    assert not answer.claimed
    assert "of the weight" in answer.refusal
    assert answer.T_ground_mav is not None
    off = (answer.T_ground_mav @ given.sighting.T_mav_camera).translation
    assert min(abs(off[0] - 1.25), abs(off[0] + 1.25)) < 0.05


def test_sums_of_shifted_descriptors_against_a_loop() -> None:
    rng = np.random.default_rng(4)
    aerial, ground = rng.normal(size=(3, SECTORS)), rng.normal(size=(2, 3, SECTORS))
    aerial[rng.random(aerial.shape) < 0.3] = np.nan
    ground[rng.random(ground.shape) < 0.3] = np.nan
    area = np.array([[1.0], [2.0], [3.0]], np.float32)
    sums = context._shifted_sums(aerial, ground, area)
    a, g = aerial - np.nanmean(aerial), ground - np.nanmean(ground)
    for place, shift in ((0, 0), (1, 7), (1, 179)):
        there = np.roll(g[place], -shift, axis=1)
        both = np.isfinite(a) & np.isfinite(there)
        weight = np.broadcast_to(area, a.shape)[both]
        x, y = a[both], there[both]
        terms = (np.ones_like(x), x, y, x**2, y**2, x * y)
        expected = [float((weight * term).sum()) for term in terms]
        found = [s[place, shift] for s in sums]
        np.testing.assert_allclose(found, expected, atol=1e-3)


def test_ring_moments_are_those_of_the_cells() -> None:
    heights = np.random.default_rng(1).normal(size=(31, 29)).astype(np.float32)
    heights[3:9, 4:12] = np.nan
    grid = PolarGrid.around(HeightMap(np.ones((21, 21), np.float32), np.array([-10.0, -10.0]), 1.0))
    means, spreads = context._moments(heights.astype(np.float64), grid)
    size = 2 * grid.reach + 1
    assert means.shape == (RINGS, 31 - size + 1, 29 - size + 1)
    x, y, ring = 2, 1, 15
    values = heights[x : x + size, y : y + size][grid.ring == ring]
    values = values[np.isfinite(values)]
    assert means[ring, x, y] == pytest.approx(values.mean(), abs=1e-3)
    assert spreads[ring, x, y] == pytest.approx(values.std(), abs=1e-3)


def test_allowed_turns_follow_the_magnetometers() -> None:
    given = given_of(bare_floor())
    allowed = np.flatnonzero(allowed_turns(given)) * 360 / SECTORS
    heading_deg = np.rad2deg(T_GROUND_MAV.heading())
    assert (np.abs(allowed - heading_deg) <= 15).all()
    assert len(allowed) == 15
    unknown = replace(given, sighting=replace(given.sighting, heading=None))
    searched = replace(given, config=with_localization(given.config, heading="search"))
    assert allowed_turns(unknown).all()
    assert allowed_turns(searched).all()


def slope_of(heights: NDArray) -> Slopes:
    return Slopes.of(HeightMap(heights.astype(np.float32), np.zeros(2), 25.0), 0.04)


def test_slopes_of_a_plane_are_its_slopes_in_the_middle() -> None:
    x, y = np.meshgrid(np.arange(40) / 25, np.arange(30) / 25, indexing="ij")
    slopes = slope_of(0.3 * x - 0.2 * y)
    np.testing.assert_allclose(slopes.field[0, 8:-8, 8:-8], 0.3, atol=1e-4)
    np.testing.assert_allclose(slopes.field[1, 8:-8, 8:-8], -0.2, atol=1e-4)
    assert np.isnan(slopes.field[:, 0]).all()


def test_a_hole_has_no_slope_and_lends_none() -> None:
    heights = np.zeros((20, 20))
    heights[10, 10] = np.nan
    field = slope_of(heights).field
    assert np.isnan(field[:, 9:12, 10]).all()
    assert np.isnan(field[:, 10, 9:12]).all()
    assert field[0, 8, 8] == 0


def test_correlation_of_slopes_does_not_know_the_datum_and_knows_the_turn() -> None:
    given = given_of(boxes_on_floor())
    maps = pair_of(given.sighting, with_localization(given.config, heading="search"))
    aerial, ground = Slopes.of(maps.aerial, 0.05), Slopes.of(maps.ground, 0.05)
    # The camera is above the origin of `ground`.
    true = np.array([0.0, 0.0, T_GROUND_MAV.heading()])
    off = np.array([[0, 0, 0], [0, 0, 0.5], [0.3, 0, 0], [9.0, 0, 0]])
    poses = true + off
    right, turned_by, shifted, outside = gradients.likenesses(poses, aerial.cells(), ground, maps)
    assert right > 0.8
    assert turned_by < right - 0.2
    assert shifted < right - 0.2
    assert np.isnan(outside)


def test_clusters_are_apart_and_led_by_their_best() -> None:
    particles = np.array([[0, 0, 0], [0.1, 0, 0], [2, 0, 0], [0, 0.05, 1.0], [5, 5, 0]], float)
    likeness = np.array([0.5, 0.9, 0.7, 0.6, np.nan])
    clusters = clustered(particles, likeness)
    assert [len(members) for members in clusters] == [2, 1, 1]
    np.testing.assert_array_equal([members[0, 3] for members in clusters], [0.9, 0.7, 0.6])
