"""Figure 4 on a world whose truth is exact: from images to the augmented map."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from airground.config import Config
from airground.core.belief import Alignment, Belief
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud, Source
from airground.core.events import (
    Aligned,
    BeliefUpdated,
    Event,
    GroundMapExtended,
    MapAugmented,
    NotLocated,
    SurfaceCast,
    TrackingLost,
)
from airground.core.messages import (
    GroundImage,
    ImuSamples,
    MagneticSamples,
    MavImage,
    RobotCalibration,
    Stamped,
)
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import AerialSurface
from airground.core.trajectory import Trajectory
from airground.localization.height_map_pair import HeightMapPair
from airground.pipeline import NO_HEADING, NO_POSE, Pipeline
from airground.slam.front_end import TrackedPose, Tracking
from airground.tracking import FrontEnds, TrackedFrame, Trackers
from tests.dense.synthetic import CAMERA, flight, heap_world, noisy
from tests.localization.synthetic import aerial_points, box_heap, ground_points

GROUND_CAMERA = PinholeCamera(320, 240, 262.0, 262.0, 159.5, 119.5)
T_WORLD_MAV = SE3.from_heading(0.6, [1.5, -0.4, 0.8])
"""The MAV's map frame, unknown to the pipeline; the frame `ground` is the world's."""
NORTH = np.array([2e-5, 0.0, -4e-5])
CALIBRATION = {
    "mav": RobotCalibration(CAMERA, SE3.identity(), SE3.identity()),
    "ground": RobotCalibration(GROUND_CAMERA, SE3.identity(), SE3.identity()),
}


class Known:
    """A front end that returns given poses; None where it is lost."""

    def __init__(self, poses: dict[int, SE3 | None]) -> None:
        self.poses = poses

    def add_imu(self, samples: ImuSamples) -> None:
        raise AssertionError("no inertial samples here")

    def track(self, image: MavImage | GroundImage) -> TrackedPose:
        pose = self.poses[image.stamp_ns]
        return TrackedPose(image.stamp_ns, Tracking.TRACKED if pose else Tracking.LOST, pose)

    def finish(self) -> None:
        """What is known needs no optimization."""

    def trajectory(self) -> Trajectory | None:
        known = {stamp: pose for stamp, pose in self.poses.items() if pose is not None}
        return Trajectory.from_poses(list(known), list(known.values())) if known else None


class Claimed:
    """A localizer that claims one place for every surface."""

    config = Config()

    def __init__(self, T_ground_mav: SE3) -> None:
        nothing, unknown = np.zeros((1, 3)), np.zeros(3)
        self.belief = Belief(
            0, nothing, unknown, np.eye(2), 0.0, 0.0, T_ground_mav, converged=True, refusal=""
        )

    def update(self, pair: HeightMapPair) -> Iterator[Event]:
        yield BeliefUpdated(pair.stamp_ns, self.belief)


class Recorded:
    """Messages of both robots, and where their cameras were."""

    def __init__(self) -> None:
        rng = np.random.default_rng(5)
        world = heap_world(1)
        self.messages: list[Stamped] = []
        self.mav: dict[int, SE3 | None] = {}
        self.ground: dict[int, SE3 | None] = {}
        for i, T_world_camera in enumerate(_around(24)):
            stamp = i * 10_000_000
            depth = world.depth(GROUND_CAMERA, T_world_camera).astype(np.float32)
            depth = np.where(depth < 5, depth + rng.normal(0, 0.004, depth.shape), np.nan)
            colour = np.full((*depth.shape, 3), 90, np.uint8)
            self._add(Source.GROUND, GroundImage(stamp, colour, depth), T_world_camera)
            self.ground[stamp] = T_world_camera
        for i, T_world_camera in enumerate(flight(85, step_m=0.03)):
            stamp = 1_000_000_000 + i * 33_000_000
            image = noisy(world.grey(CAMERA, T_world_camera, supersample=1), rng)
            self._add(Source.MAV, MavImage(stamp, image), T_world_camera)
            self.mav[stamp] = T_WORLD_MAV.inverse() @ T_world_camera

    def _add(self, robot: Source, image: MavImage | GroundImage, T_world_camera: SE3) -> None:
        field = T_world_camera.rotation.T @ NORTH
        stamps = image.stamp_ns - np.arange(5, 0, -1) * 1_000_000
        samples = MagneticSamples(stamps, np.tile(field, (5, 1)))
        self.messages += [Stamped(robot, samples), Stamped(robot, image)]

    def frames(self, front_ends: FrontEnds) -> Iterator[TrackedFrame]:
        trackers = Trackers(CALIBRATION["mav"], CALIBRATION["ground"], front_ends)
        return trackers.frames(self.messages)

    def run(self, prior: SE3 | None = None) -> tuple[Pipeline, list[Event]]:
        pipeline = empty_pipeline(prior)
        frames = self.frames(FrontEnds(Known(self.mav), Known(self.ground)))
        return pipeline, list(pipeline.run(frames))


def empty_pipeline(prior: SE3 | None = None) -> Pipeline:
    rng = np.random.default_rng(0)
    return Pipeline(Config(), CALIBRATION["mav"], CALIBRATION["ground"], rng, prior)


def _around(count: int) -> Iterator[SE3]:
    """Cameras on an ellipse around the heap, 1.3 m up, looking inwards and down.

    The last one stands near the flight: the MAV is searched within 3 m of the ground robot.
    """
    for angle in np.linspace(-1.5 * np.pi, 0.5 * np.pi, count):
        inward = -np.array([np.cos(angle), np.sin(angle), 0.35])
        z = inward / np.linalg.norm(inward)
        x = np.cross(z, [0, 0, 1])
        x /= np.linalg.norm(x)
        centre = np.array([0.8 + 3.2 * np.cos(angle), 2.4 * np.sin(angle), 1.3])
        yield SE3(np.stack([x, np.cross(z, x), z], axis=1), centre)


def offset(T_ground_mav: SE3, recorded: Recorded) -> tuple[float, float]:
    """Error of the MAV's last camera pose [m, deg]."""
    camera = next(pose for pose in reversed(recorded.mav.values()) if pose is not None)
    error = (T_WORLD_MAV @ camera).inverse() @ (T_ground_mav @ camera)
    return float(np.linalg.norm(error.translation)), float(np.rad2deg(error.angle()))


@pytest.fixture(scope="module")
def recorded() -> Recorded:
    return Recorded()


@pytest.fixture(scope="module")
def found(recorded: Recorded) -> tuple[Pipeline, list[Event]]:
    return recorded.run()


def of(events: list[Event], kind: type) -> list:
    return [event for event in events if isinstance(event, kind)]


@pytest.mark.slow
def test_locates_refines_and_augments(
    recorded: Recorded, found: tuple[Pipeline, list[Event]]
) -> None:
    pipeline, events = found
    assert len(of(events, SurfaceCast)) >= 2
    belief = of(events, BeliefUpdated)[-1].belief
    assert belief.converged, belief.refusal
    assert offset(belief.T_ground_mav, recorded)[0] < 0.15
    alignment = of(events, Aligned)[-1].alignment
    assert alignment.accepted, alignment.refusal
    metres, degrees = offset(alignment.T_ground_mav, recorded)
    assert metres < 0.015
    assert degrees < 0.5
    augmented = pipeline.augmented_map()
    assert set(augmented.sources) == {Source.GROUND, Source.MAV}
    assert of(events, MapAugmented)


@pytest.mark.slow
def test_stages_report_in_the_order_of_figure_4(found: tuple[Pipeline, list[Event]]) -> None:
    kinds = [type(event) for event in found[1]]
    order = [GroundMapExtended, SurfaceCast, BeliefUpdated, Aligned, MapAugmented]
    first = [kinds.index(kind) for kind in order]
    assert first == sorted(first)


@pytest.mark.slow
def test_a_prior_skips_the_global_search(recorded: Recorded) -> None:
    prior = SE3.from_heading(0.02, [0.15, -0.1, 0.1]) @ T_WORLD_MAV
    _, events = recorded.run(prior)
    assert not of(events, BeliefUpdated)
    assert offset(of(events, Aligned)[-1].alignment.T_ground_mav, recorded)[0] < 0.015


@pytest.mark.slow
def test_same_seed_same_bytes(recorded: Recorded, found: tuple[Pipeline, list[Event]]) -> None:
    _, again = recorded.run()
    for one, two in zip(of(found[1], Aligned), of(again, Aligned), strict=True):
        one_bytes = one.alignment.T_ground_mav.matrix().tobytes()
        assert one_bytes == two.alignment.T_ground_mav.matrix().tobytes()


@pytest.mark.slow
def test_a_surface_without_a_heading_or_a_pose_says_why(recorded: Recorded) -> None:
    """Without magnetometers the heading is unknown; a ground robot without a map has no pose."""
    images = [one for one in recorded.messages if not isinstance(one.message, MagneticSamples)]
    known = FrontEnds(Known(recorded.mav), Known(recorded.ground))
    lost = FrontEnds(Known(recorded.mav), Known(dict.fromkeys(recorded.ground)))
    for front_ends, reason in ((known, NO_HEADING), (lost, NO_POSE)):
        trackers = Trackers(CALIBRATION["mav"], CALIBRATION["ground"], front_ends)
        events = list(empty_pipeline().run(trackers.frames(images)))
        reasons = {event.reason for event in of(events, NotLocated)}
        assert reasons == {reason}
        assert len(of(events, NotLocated)) == len(of(events, SurfaceCast)) >= 2
        assert not of(events, BeliefUpdated)


@pytest.mark.slow
def test_lost_tracking_is_reported_and_maps_nothing(recorded: Recorded) -> None:
    lost = dict.fromkeys(recorded.mav)
    pipeline = empty_pipeline()
    frames = recorded.frames(FrontEnds(Known(lost), Known(recorded.ground)))
    events = list(pipeline.run(frames))
    assert len(of(events, TrackingLost)) == len(lost)
    assert not of(events, SurfaceCast)
    assert (pipeline.augmented_map().sources == Source.GROUND).all()


def test_a_claim_binds_refinement_and_a_prior_does_not() -> None:
    """A prior is a guess of the user, from which refinement may lead away (Sec. III)."""
    away = SE3.from_heading(0.0, [0.3, 0.0, 0.0]) @ T_WORLD_MAV
    located = empty_pipeline()
    located._localizer = Claimed(away)
    refused, taken = aligned(located), aligned(empty_pipeline(away))
    assert refused.refusal.startswith("leads away: 0.30 m"), refused.refusal
    assert not refused.accepted
    assert taken.accepted, taken.refusal
    for alignment in (refused, taken):
        error = alignment.T_ground_mav @ T_WORLD_MAV.inverse()
        assert np.linalg.norm(error.translation) < 0.01


def aligned(pipeline: Pipeline) -> Alignment:
    """What one surface over a heap of boxes is refined to."""
    events = list(pipeline.locate_and_augment(sighting_of_boxes()))
    (event,) = of(events, Aligned)
    assert bool(of(events, MapAugmented)) == event.alignment.accepted
    return event.alignment


def sighting_of_boxes() -> Sighting:
    world, rng = box_heap(1), np.random.default_rng(0)
    above = SE3(np.diag([1.0, -1.0, -1.0]), np.array([0.2, 0.3, 2.2]))
    aerial = T_WORLD_MAV.inverse() @ aerial_points(world, *above.translation[:2], rng)
    no_depth = np.full((CAMERA.height, CAMERA.width), np.nan, np.float32)
    T_mav_camera = T_WORLD_MAV.inverse() @ above
    surface = AerialSurface(0, 0, CAMERA, T_mav_camera, no_depth, grey_cloud(aerial), 1)
    ground = grey_cloud(ground_points(world, rng, frames=40))
    return Sighting(surface, ground, 0, T_mav_camera, 0, SE3.identity(), heading=0.6)


def grey_cloud(points: np.ndarray) -> PointCloud:
    return PointCloud(points.astype(np.float32), np.zeros((len(points), 3), np.uint8))
