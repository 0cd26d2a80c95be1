"""Point-to-plane refinement: known motions come back, nonsense is refused with a reason."""

import numpy as np
import pytest

from airground.config import Config, paper
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.refinement import refine
from airground.refinement.icp import point_to_plane_icp
from airground.refinement.surfels import make_surfels
from tests.localization.synthetic import aerial_points, box_heap, flat_world, ground_points

T_WORLD_MAV = SE3.from_heading(1.1, (0.5, -0.3, 0.1))
CAMERA = np.array([0.2, 0.3, 2.2])


def cloud(points):
    return PointCloud(np.asarray(points, np.float32), np.zeros((len(points), 3), np.uint8))


def pair_of(world, ground_world, frames=40):
    rng = np.random.default_rng(0)
    aerial = aerial_points(world, *CAMERA[:2], rng)
    return cloud(T_WORLD_MAV.inverse() @ aerial), cloud(
        ground_points(ground_world, rng, frames=frames)
    )


def noisy(rng, sigma_m=0.2, sigma_deg=3.0):
    """The true motion with the camera's pose disturbed per axis, as in Sec. VIII-D."""
    turn = SE3.from_rotation_vector(np.deg2rad(sigma_deg) * rng.normal(size=3)).rotation
    shift = sigma_m * rng.normal(size=3)
    return SE3(turn, CAMERA + shift - turn @ CAMERA) @ T_WORLD_MAV


def error(motion):
    """Translation of the camera [m] and angle [deg] off the truth."""
    camera_mav = T_WORLD_MAV.inverse() @ CAMERA
    turn = (motion @ T_WORLD_MAV.inverse()).angle()
    return np.linalg.norm(motion @ camera_mav - CAMERA), np.rad2deg(turn)


def floor_with_one_box(rng, points_per_m2=2500, noise_m=0.003):
    """(N, 3) points on 4 x 4 m of floor and on a box of 0.5 x 0.4 x 0.3 m in its middle."""

    def on_rectangle(*sides):
        area = np.prod([high - low for low, high in sides if high > low])
        low, high = np.transpose(sides)
        return rng.uniform(low, high, (round(points_per_m2 * area), 3))

    floor = on_rectangle((-2, 2), (-2, 2), (0, 0))
    under = (np.abs(floor[:, 0]) < 0.25) & (np.abs(floor[:, 1]) < 0.2)
    floor[under, 2] = 0.3
    parts = [floor]
    for sign in (-1, 1):
        parts.append(on_rectangle((0.25 * sign, 0.25 * sign), (-0.2, 0.2), (0, 0.3)))
        parts.append(on_rectangle((-0.25, 0.25), (0.2 * sign, 0.2 * sign), (0, 0.3)))
    points = np.concatenate(parts)
    return points + rng.normal(0, noise_m, points.shape)


@pytest.fixture(scope="module")
def heap():
    world = box_heap(1)
    return pair_of(world, world)


def test_best_comes_back_from_the_papers_noise(heap):
    rng = np.random.default_rng(1)
    for _ in range(4):
        alignment = refine(5, noisy(rng), *heap, Config())
        metres, degrees = error(alignment.T_ground_mav)
        assert alignment.accepted, alignment.refusal
        assert alignment.stamp_ns == 5
        assert metres < 0.01
        assert degrees < 0.2
        assert alignment.inliers > 0.7
        assert alignment.rmse_m < 0.02


def test_an_alignment_that_leads_away_from_a_claim_is_refused(heap):
    for shift, accepted in ((0.15, True), (0.3, False)):
        start = SE3(np.eye(3), np.array([shift, 0.0, 0.0])) @ T_WORLD_MAV
        assert refine(0, start, *heap, Config()).accepted
        alignment = refine(0, start, *heap, Config(), claimed=True)
        assert alignment.accepted == accepted
        assert alignment.refusal.startswith("leads away: 0.30 m") == (not accepted)
        assert error(alignment.T_ground_mav)[0] < 0.01


def test_an_alignment_that_turns_a_claim_far_is_refused(heap):
    turn = SE3.from_heading(np.deg2rad(6.0)).rotation
    start = SE3(turn, CAMERA - turn @ CAMERA) @ T_WORLD_MAV
    assert refine(0, start, *heap, Config()).accepted
    alignment = refine(0, start, *heap, Config(), claimed=True)
    assert not alignment.accepted
    assert "6.0 deg from the place that is claimed" in alignment.refusal


def test_paper_comes_back_from_nearby(heap):
    rng = np.random.default_rng(2)
    for _ in range(2):
        alignment = refine(0, noisy(rng, 0.02, 0.5), *heap, paper())
        metres, degrees = error(alignment.T_ground_mav)
        assert metres < 0.01
        assert degrees < 0.2


@pytest.mark.parametrize("start", [(0.1, 0.05, 2.0), (0.1, -0.1, -2.0), (-0.15, 0.1, 2.0)])
def test_one_box_on_a_large_floor_is_enough(start):
    """Most points lie on the floor wherever they are put; the box alone says where they belong."""
    rng = np.random.default_rng(4)
    settings = paper().refinement
    source, target = (make_surfels(floor_with_one_box(rng), settings.voxel_m) for _ in range(2))
    x, y, heading_deg = start
    fit = point_to_plane_icp(
        source.points, target, SE3.from_heading(np.deg2rad(heading_deg), (x, y, 0)), settings
    )
    assert np.linalg.norm(fit.translation) < 0.005
    assert np.rad2deg(fit.angle()) < 1.0


def test_same_input_same_output(heap):
    start = noisy(np.random.default_rng(3))
    one, other = (refine(0, start, *heap, Config()).T_ground_mav.matrix() for _ in range(2))
    np.testing.assert_array_equal(one, other)


def test_another_heap_is_refused(heap):
    _, ground = pair_of(box_heap(2), box_heap(2))
    rng = np.random.default_rng(4)
    for _ in range(3):
        alignment = refine(0, noisy(rng), heap[0], ground, Config())
        assert not alignment.accepted
        assert alignment.refusal


@pytest.mark.parametrize("config", [Config(), paper()], ids=["best", "paper"])
def test_flat_ground_does_not_constrain_and_is_refused(config):
    flat = pair_of(flat_world(), flat_world(), frames=15)
    alignment = refine(0, noisy(np.random.default_rng(5)), *flat, config)
    assert not alignment.accepted
    assert "too little structure" in alignment.refusal


@pytest.mark.parametrize("config", [Config(), paper()], ids=["best", "paper"])
def test_empty_or_far_clouds_are_refused_with_the_reason(heap, config):
    aerial, ground = heap
    far = SE3(np.eye(3), np.array([80.0, 0.0, 0.0]))
    cases = [
        (aerial, PointCloud.empty(), T_WORLD_MAV, "ground cloud has 0 points"),
        (PointCloud.empty(), ground, T_WORLD_MAV, "aerial cloud has 0 points"),
        (aerial, ground, far, "no overlap"),
    ]
    for source, target, start, reason in cases:
        alignment = refine(0, start, source, target, config)
        assert not alignment.accepted
        assert reason in alignment.refusal
        assert np.isnan(alignment.rmse_m)


def test_icp_recovers_known_motions_exactly_without_noise():
    rng = np.random.default_rng(6)
    sides = [rng.uniform(0, 1, (4000, 3)) * (1 - np.eye(3)[axis]) for axis in range(3)]
    corner = np.concatenate(sides)
    target = make_surfels(corner, 0.03)
    truth = SE3.from_rotation_vector((0.02, -0.03, 0.05), (0.03, -0.02, 0.04))
    source = truth.inverse() @ rng.permutation(corner)[:6000]
    fit = point_to_plane_icp(source, target, SE3.identity(), Config().refinement)
    off = fit @ truth.inverse()
    assert np.linalg.norm(off.translation) < 2e-3
    assert off.angle() < 2e-3
