"""Monte Carlo localization on heaps of boxes: found where it is, refused where it is not."""

import numpy as np
import pytest

from airground.config import Config, paper, paper_literal
from airground.core.events import BeliefUpdated, CostMapComputed, HeightMapsMade
from airground.core.se3 import SE3
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import MonteCarloLocalizer
from tests.localization.synthetic import aerial_points, box_heap, flat_world, ground_points

HEADING = 2.0
T_MAV_WORLD = SE3.from_heading(-HEADING, (1.0, 2.0, 0.3))
ROBOT = np.array([0.3, 0.0])
MIRROR = np.array([-1, 1, 1], np.float32)
PATH = [(-0.6, 0.2), (-0.2, 0.3), (0.2, 0.3), (0.6, 0.2)]


class Flight:
    """What the MAV saw along a path over a world, and the ground robot's points."""

    def __init__(self, world, ground_world, frames=40):
        rng = np.random.default_rng(3)
        self.maps = []
        for x, y in PATH:
            points = (T_MAV_WORLD @ aerial_points(world, x, y, rng, 0.1)).astype(np.float32)
            self.maps.append((points, T_MAV_WORLD @ np.array([x, y, 2.2])))
        self.ground = ground_points(ground_world, rng, frames=frames)

    def localize(self, config, heading=HEADING, seed=0):
        localizer = MonteCarloLocalizer(config, np.random.default_rng(seed))
        events = []
        for stamp, (points, position) in enumerate(self.maps):
            pair = HeightMapPair(stamp, points, position, self.ground, ROBOT, heading, config)
            events.append(list(localizer.update(pair)))
        return events


def beliefs(events):
    return [update[-1].belief for update in events]


@pytest.fixture(scope="module")
def flight():
    heap = box_heap(1)
    return Flight(heap, heap)


@pytest.fixture(scope="module")
def flat_flight():
    return Flight(flat_world(), flat_world(), frames=15)


@pytest.fixture(scope="module")
def lost_flight():
    return Flight(box_heap(1), box_heap(2))


def changed(config, **changes):
    local = config.localization.model_copy(update=changes)
    return config.model_copy(update={"localization": local})


def test_best_converges_on_the_truth(flight):
    found = beliefs(flight.localize(Config()))
    for belief, place in zip(found, PATH, strict=True):
        assert np.hypot(*(belief.estimate[:2] - place)) < 0.1
        assert belief.estimate[2] == pytest.approx(HEADING, abs=np.deg2rad(1.0))
    last = found[-1]
    assert last.converged, last.refusal
    assert last.height_offset == pytest.approx(-0.3, abs=0.03)
    corner = np.array([0.4, 0.1, 0.5])
    np.testing.assert_allclose(last.T_ground_mav @ (T_MAV_WORLD @ corner), corner, atol=0.12)


@pytest.mark.parametrize("off_deg", [-3.0, 3.0])
def test_a_known_heading_that_is_off_is_turned_right(flight, off_deg):
    """The particles keep the magnetometers' heading; the reported pose fits the heights."""
    heading = HEADING + np.deg2rad(off_deg)
    for found in beliefs(flight.localize(Config(), heading)):
        np.testing.assert_allclose(found.particles[:, 2], heading)
        assert abs(np.rad2deg(found.estimate[2] - HEADING)) < 1.5
    as_known = beliefs(flight.localize(changed(Config(), estimate="mean"), heading))
    assert all(found.estimate[2] == pytest.approx(heading) for found in as_known)


def test_searched_heading_finds_position_and_turn(flight):
    config = changed(Config(), heading="search", headings=180)
    last = beliefs(flight.localize(config, heading=None))[-1]
    assert np.hypot(*(last.estimate[:2] - PATH[-1])) < 0.2
    assert abs(np.angle(np.exp(1j * (last.estimate[2] - HEADING)))) < np.deg2rad(3)


def test_paper_computes_the_cost_map_once_and_best_each_time(flight):
    kinds = [[type(event) for event in update] for update in flight.localize(paper())]
    first = [HeightMapsMade, CostMapComputed, BeliefUpdated]
    assert kinds == [first] + [[HeightMapsMade, BeliefUpdated]] * 3
    assert [len(update) for update in flight.localize(Config())] == [3] * 4


def test_the_published_sigma_converges_as_the_paper_has_it_and_never_in_square_metres(flight):
    assert beliefs(flight.localize(paper()))[-1].converged
    assert not any(belief.converged for belief in beliefs(flight.localize(paper_literal())))


def test_same_seed_same_belief(flight):
    one, other = (beliefs(flight.localize(Config(), seed=4))[-1] for _ in range(2))
    np.testing.assert_array_equal(one.particles, other.particles)


@pytest.mark.parametrize(
    "config",
    [
        Config(),
        paper(),
        changed(paper_literal(), sigma_units="minmax"),
        changed(Config(), heading="search"),
    ],
    ids=["best", "paper", "minmax", "search"],
)
def test_flat_ground_claims_nothing_and_says_why(flat_flight, config):
    if config.localization.heading == "search":
        config = changed(config, headings=30)
    for belief in beliefs(flat_flight.localize(config)):
        assert not belief.converged
        assert "no structure" in belief.refusal


@pytest.mark.parametrize(
    "cost_sigma", [("channels", 1.0), ("likelihood", 1.0), ("ncc", 0.05), ("zmssd", 0.001)]
)
def test_another_heaps_map_is_refused(lost_flight, cost_sigma):
    cost, sigma = cost_sigma
    config = changed(Config(), cost=cost, sigma=sigma)
    for belief in beliefs(lost_flight.localize(config)):
        assert not belief.converged
        assert belief.refusal


def test_a_claim_needs_the_newest_surface_over_the_ground_map(flight) -> None:
    """Earlier ones, laid over it as one with the newest, do not make up for it."""
    config = changed(Config(), heading="search", headings=180)
    robot, (points, position) = np.zeros(2), flight.maps[-1]
    away = position + np.array([0.0, 0.0, 0.2])
    beside = points + np.float32(40.0) * np.array([1, 0, 0], np.float32)
    known = HeightMapPair(0, points, position, flight.ground, robot, None, config)
    newest = HeightMapPair(1, beside, away, flight.ground, robot, None, config)
    joined = newest.joined([known])
    there = np.array([*PATH[-1], HEADING])
    assert known.newest_overlap(there) > 0.9
    assert joined.newest_overlap(there) == 0.0
    assert 0.3 < joined.overlay(there[None]).overlaps()[0] < 0.6
    localizer = MonteCarloLocalizer(config, np.random.default_rng(0))
    for pair in (known, newest):
        *_, last = localizer.update(pair)
    assert not last.belief.converged
    said = "0% of the newest aerial map lies on the ground map, 30% are needed"
    assert said in last.belief.refusal


def test_a_claim_needs_heights_of_the_newest_surface_that_agree(flight) -> None:
    """Earlier ones, laid over the ground map as one with the newest, do not make up for it."""
    config = changed(Config(), heading="search", headings=180)
    *maps, (points, position) = flight.maps
    camera = position.astype(np.float32)
    middle = points[np.abs(points - camera)[:, :2].max(axis=1) < 0.6]
    found = []
    for last in (middle, camera + (middle - camera) * MIRROR):
        localizer = MonteCarloLocalizer(config, np.random.default_rng(0))
        for stamp, (surface, place) in enumerate([*maps, (last, position)]):
            pair = HeightMapPair(stamp, surface, place, flight.ground, ROBOT, None, config)
            *_, update = localizer.update(pair)
        found.append(update.belief)
    right, wrong = found
    assert right.converged
    np.testing.assert_allclose(wrong.estimate[:2], right.estimate[:2], atol=0.1)
    assert not wrong.converged
    assert "heights disagree: the newest agree over" in wrong.refusal


def test_a_map_without_overlap_neither_kills_the_belief_nor_claims(flight):
    localizer = MonteCarloLocalizer(Config(), np.random.default_rng(0))
    robot = np.zeros(2)
    (points, position) = flight.maps[0]
    steps = [flight.ground, flight.ground + np.float32(50), flight.ground]
    found = []
    for stamp, ground in enumerate(steps):
        pair = HeightMapPair(stamp, points, position, ground, robot, HEADING, Config())
        *_, last = localizer.update(pair)
        found.append(last.belief)
    assert not found[1].converged
    assert "lies on the ground map" in found[1].refusal
    assert found[1].overlap == 0.0
    assert found[2].overlap > 0.9
    assert np.hypot(*(found[2].estimate[:2] - PATH[0])) < 0.1


@pytest.mark.parametrize("points", [np.zeros((0, 3), np.float32), np.zeros((3, 3), np.float32)])
@pytest.mark.parametrize("heading", ["known", "search"])
def test_an_empty_surface_is_refused_not_an_error(flight, points, heading):
    config = changed(Config(), heading=heading, headings=30)
    localizer = MonteCarloLocalizer(config, np.random.default_rng(0))
    pair = HeightMapPair(0, points, np.zeros(3), flight.ground, np.zeros(2), HEADING, config)
    *_, last = localizer.update(pair)
    assert not last.belief.converged
    assert last.belief.refusal


def test_particles_of_a_known_heading_see_one_map_and_the_reported_pose_several(flight):
    with_joint, without = (
        beliefs(flight.localize(changed(Config(), joint_maps=maps))) for maps in (4, 1)
    )
    for joint, alone in zip(with_joint, without, strict=True):
        np.testing.assert_array_equal(joint.particles, alone.particles)
        assert joint.overlap == pytest.approx(alone.overlap, abs=0.05)
    np.testing.assert_array_equal(with_joint[0].estimate, without[0].estimate)

    def worst_deg(found):
        return np.rad2deg(max(abs(belief.estimate[2] - HEADING) for belief in found[2:]))

    assert not np.array_equal(with_joint[-1].estimate, without[-1].estimate)
    assert worst_deg(with_joint) < 0.8


def test_several_maps_together_sharpen_a_searched_heading(flight):
    def worst_deg(maps):
        config = changed(Config(), heading="search", headings=180, joint_maps=maps)
        found = beliefs(flight.localize(config, heading=None))
        off = [np.angle(np.exp(1j * (belief.estimate[2] - HEADING))) for belief in found[2:]]
        return np.rad2deg(np.abs(off)).max()

    assert worst_deg(4) < 0.8
    assert worst_deg(4) < worst_deg(1)
