"""The seam between the front ends and the two maps: what every kind of answer leads to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from airground.config import Config, GroundMapping
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud, Source
from airground.core.events import (
    Event,
    GroundMapExtended,
    GroundTracked,
    Initializing,
    MavTracked,
    PosesCorrected,
    TrackingLost,
)
from airground.core.messages import (
    CalibrationSigmas,
    GroundImage,
    ImuSamples,
    MavImage,
    RobotCalibration,
    Stamped,
)
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface
from airground.core.trajectory import Trajectory
from airground.dense.reconstruction import DenseReconstruction
from airground.ground_map import GroundMap
from airground.pipeline import Mapping, pose_errors_of
from airground.slam.front_end import ScaleEstimate, TrackedPose, Tracking
from airground.tracking import FrontEnds, TrackedFrame, Trackers

CAMERA = PinholeCamera(160, 120, 130.0, 130.0, 79.5, 59.5)
CALIBRATION = RobotCalibration(CAMERA, SE3.identity(), SE3.identity())
DEPTH_SCALE_SIGMA = 0.02
OF_GROUND = replace(CALIBRATION, sigmas=CalibrationSigmas(depth_scale=DEPTH_SCALE_SIGMA))
CONFIG = Config(ground_mapping=GroundMapping(min_keyframes=1))
COVARIANCE = np.diag([1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6])


class Scripted:
    """A front end that returns given answers."""

    def __init__(self, answers: Sequence[TrackedPose], final: Trajectory | None = None) -> None:
        self.answers = {answer.stamp_ns: answer for answer in answers}
        self.final = final
        self.finished = False

    def add_imu(self, samples: ImuSamples) -> None:
        """Nothing to be learned from them."""

    def track(self, image: MavImage | GroundImage) -> TrackedPose:
        return self.answers[image.stamp_ns]

    def finish(self) -> None:
        self.finished = True

    def trajectory(self) -> Trajectory | None:
        return self.final


def at(x: float) -> SE3:
    return SE3.from_heading(0.0, [x, 0.0, 0.0])


def tracked(
    stamp_ns: int, x: float, corrected: bool = False, scale_sigma: float = 0.004
) -> TrackedPose:
    scale = ScaleEstimate(scale_sigma, True)
    return TrackedPose(stamp_ns, Tracking.TRACKED, at(x), COVARIANCE, scale, corrected=corrected)


def unposed(stamp_ns: int, tracking: Tracking) -> TrackedPose:
    return TrackedPose(stamp_ns, tracking, None)


def mav_image(stamp_ns: int) -> Stamped:
    return Stamped(Source.MAV, MavImage(stamp_ns, np.zeros((120, 160), np.uint8)))


def ground_image(stamp_ns: int) -> GroundImage:
    return GroundImage(
        stamp_ns, np.full((120, 160, 3), 90, np.uint8), np.full((120, 160), 2.007, np.float32)
    )


class Fed:
    """Both trackers and the maps above them, fed message by message."""

    def __init__(self, mav: Scripted, ground: Scripted) -> None:
        self.trackers = Trackers(CALIBRATION, OF_GROUND, FrontEnds(mav, ground))
        self.mapping = Mapping(CONFIG, CALIBRATION, OF_GROUND)

    def add(self, stamped: Stamped) -> list[Event]:
        (frame,) = self.trackers.frames([stamped])
        return list(self.mapping.take(frame))


def kinds(events: Sequence[Event]) -> list[type[Event]]:
    return [type(event) for event in events]


def test_initializing_is_not_lost() -> None:
    answers = [
        unposed(0, Tracking.INITIALIZING),
        tracked(1, 0.0),
        unposed(2, Tracking.LOST),
        tracked(3, 0.0, corrected=True),
    ]
    made = Fed(Scripted(answers), Scripted([]))
    events = [event for stamp in range(4) for event in made.add(mav_image(stamp))]
    assert kinds(events) == [Initializing, MavTracked, TrackingLost, MavTracked, PosesCorrected]
    assert [event.stamp_ns for event in events] == [0, 1, 2, 3, 3]
    pose = events[1]
    assert isinstance(pose, MavTracked)
    assert pose.covariance is not None
    assert pose.covariance.tobytes() == COVARIANCE.tobytes()
    assert pose.scale_sigma == 0.004


def test_the_dense_stage_waits_until_the_scale_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scale that was known stays with its map, and goes with it."""
    limit = CONFIG.view_selection.max_scale_sigma
    answers = [
        tracked(0, 0.0, scale_sigma=1.5 * limit),
        tracked(1, 0.1, scale_sigma=limit),
        tracked(2, 0.2, scale_sigma=1.5 * limit),
        unposed(3, Tracking.LOST),
        tracked(4, 0.3, scale_sigma=np.inf),
        unposed(5, Tracking.INITIALIZING),
        tracked(6, 0.4, scale_sigma=1.5 * limit),
    ]
    given: list[int] = []

    def add(_: DenseReconstruction, stamp_ns: int, *_args: object) -> list[Event]:
        given.append(stamp_ns)
        return []

    monkeypatch.setattr(DenseReconstruction, "add", add)
    made = Fed(Scripted(answers), Scripted([]))
    events = [event for stamp in range(7) for event in made.add(mav_image(stamp))]
    assert kinds(events).count(MavTracked) == 5
    assert given == [1, 2, 4]


@pytest.mark.parametrize("robot", list(Source))
def test_images_of_a_rolling_shutter_are_straight_for_both_maps(
    robot: Source, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken: list[np.ndarray] = []

    def keep(_: object, *given: object) -> list[Event]:
        image = given[1] if isinstance(given[0], int) else given[0]
        taken.append(image.colour if isinstance(image, GroundImage) else np.asarray(image))
        return []

    monkeypatch.setattr(DenseReconstruction, "add", keep)
    monkeypatch.setattr(GroundMap, "add", keep)
    rolling = replace(CALIBRATION, readout_s=0.02)
    mapping = Mapping(CONFIG, rolling, rolling)
    stripes = np.tile((np.arange(160) // 8 % 2 * 255).astype(np.uint8), (120, 1))
    for stamp_ns, x in ((0, 0.0), (33_000_000, 0.1)):
        image: MavImage | GroundImage = MavImage(stamp_ns, stripes)
        if robot == Source.GROUND:
            colour = np.repeat(stripes[..., None], 3, axis=2)
            image = GroundImage(stamp_ns, colour, np.full((120, 160), 1.0, np.float32))
        pose = replace(tracked(stamp_ns, x), depth_range=(0.9, 1.1))
        list(mapping.take(TrackedFrame(image, pose)))
    before, after = (image.reshape(120, 160, -1)[..., 0] for image in taken)
    np.testing.assert_array_equal(before, stripes)  # no motion is known at the first image
    # 0.1 m in 33 ms at 1 m: the first row is taken 10 ms before the middle one, 3.9 px away.
    middle = (slice(59, 61), slice(8, -8))
    np.testing.assert_allclose(after[middle].astype(int), stripes[middle], atol=10)
    for row, shift in ((0, 4), (119, -4)):
        moved = np.roll(stripes[row], -shift)[8:-8].astype(int)
        assert np.abs(after[row, 8:-8].astype(int) - moved).mean() < 10


def test_the_ground_map_follows_corrected_poses() -> None:
    final = Trajectory.from_poses([0, 1], [at(0.05), at(0.2)])
    ground = Scripted([tracked(0, 0.0), tracked(1, 0.2, corrected=True)], final)
    made = Fed(Scripted([]), ground)
    images = [ground_image(stamp) for stamp in range(2)]
    first = made.add(Stamped(Source.GROUND, images[0]))
    assert kinds(first) == [GroundTracked, GroundMapExtended]
    assert len(made.mapping.ground_cloud()) > 0
    assert PosesCorrected in kinds(made.add(Stamped(Source.GROUND, images[1])))
    expected = GroundMap(CAMERA, CONFIG.ground_mapping)
    for image, pose in zip(images, (at(0.05), at(0.2)), strict=True):
        expected.add(image, pose)
    assert made.mapping.ground_cloud().points.tobytes() == expected.cloud().points.tobytes()


def test_a_sighting_has_both_poses_and_how_sure_slam_was_of_them() -> None:
    made = Fed(
        Scripted([tracked(0, 0.1), tracked(2, 0.3)]),
        Scripted([replace(tracked(1, 0.2), covariance=4 * COVARIANCE)]),
    )
    cloud = PointCloud(np.zeros((1, 3), np.float32), np.zeros((1, 3), np.uint8))
    depth = np.full((120, 160), 2.0, np.float32)
    surface = AerialSurface(2, 0, CAMERA, at(0.1), depth, cloud, 3)
    made.add(mav_image(0))
    assert made.mapping.sight(surface) is None  # the ground robot has no pose yet
    made.add(Stamped(Source.GROUND, ground_image(1)))
    made.add(mav_image(2))
    sighting = made.mapping.sight(surface)
    assert sighting is not None
    assert (sighting.mav_stamp_ns, sighting.ground_stamp_ns) == (2, 1)
    assert sighting.T_mav_camera.translation[0] == 0.3
    assert sighting.T_ground_camera.translation[0] == 0.2
    errors = pose_errors_of(sighting)
    np.testing.assert_array_equal(errors.turns_mav, COVARIANCE[3:, 3:])
    np.testing.assert_array_equal(errors.turns_ground, 4 * COVARIANCE[3:, 3:])
    np.testing.assert_allclose(errors.lever_mav, [0.1, 0.0, 0.0])
    np.testing.assert_array_equal(errors.ground_robot, sighting.T_ground_camera.translation)
    assert errors.ground_scale == DEPTH_SCALE_SIGMA


def test_what_the_front_ends_put_off_reaches_the_map_at_the_end() -> None:
    mav = Scripted([])
    ground = Scripted([tracked(0, 0.0)], Trajectory.from_poses([0], [at(0.5)]))
    made = Fed(mav, ground)
    made.add(Stamped(Source.GROUND, ground_image(0)))
    before = made.mapping.ground_cloud().points[:, 0].mean()
    made.mapping.correct_ground(made.trackers.finish())
    assert mav.finished
    assert ground.finished
    assert abs(made.mapping.ground_cloud().points[:, 0].mean() - before - 0.5) < 0.01
