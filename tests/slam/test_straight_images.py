"""Images of a rolling shutter over a plane, against those of a global shutter, in closed form."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.messages import GroundImage, MavImage, RobotCalibration
from airground.core.se3 import SE3
from airground.slam.front_end import TrackedPose, Tracking
from airground.slam.straight_images import StraightImages, Velocity

CAMERA = PinholeCamera(320, 240, 210.0, 210.0, 159.5, 119.5)
READOUT_S, IMAGE_NS = 0.02, 33_333_333
TURN, SHIFT = np.array([0.5, -0.4, 0.6]), np.array([0.4, -0.3, 0.2])
"""Of the camera in its own axes: a turn of 3 px and a move of 4 px in half of the readout."""
NORMAL, DISTANCE_M = np.array([0.2, -0.1, 1.0]), 1.2
"""A plane n x = d that leans, in the middle row's camera."""


def pose_at(seconds: float) -> SE3:
    """Of a camera that moves evenly, in the frame of its middle row."""
    return SE3.from_rotation_vector(TURN * seconds, SHIFT * seconds)


def seen(readout_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(H, W) depth along each row's own axis, and (H, W, 3) the points on the plane."""
    rays = CAMERA.rays()
    depth, points = np.empty(rays.shape[:2]), np.empty(rays.shape)
    for row in range(CAMERA.height):
        pose = pose_at((row / (CAMERA.height - 1) - 0.5) * readout_s)
        turned = rays[row] @ pose.rotation.T
        depth[row] = (DISTANCE_M - NORMAL @ pose.translation) / (turned @ NORMAL)
        points[row] = pose.translation + turned * depth[row][:, None]
    return depth, points


def painted(points: NDArray[np.float64]) -> NDArray[np.uint8]:
    """A smooth pattern on the plane with waves of some 20 px."""
    wave = np.sin(points[..., 0] * 55) + np.cos(points[..., 1] * 45)
    return np.asarray(127 + 60 * wave, np.uint8)


def calibration(readout_s: float) -> RobotCalibration:
    return RobotCalibration(CAMERA, SE3.identity(), SE3.identity(), readout_s=readout_s)


def following(readout_s: float = READOUT_S) -> StraightImages:
    straight = StraightImages(calibration(readout_s))
    for index in (-1, 0):
        pose = pose_at(index * IMAGE_NS * 1e-9)
        straight.follow(IMAGE_NS * (index + 1), TrackedPose(IMAGE_NS, Tracking.TRACKED, pose))
    return straight


def test_even_motion_is_found() -> None:
    velocity = Velocity.between(pose_at(-0.03), pose_at(0.0), 0.03)
    np.testing.assert_allclose(velocity.turn, TURN, atol=1e-9)
    np.testing.assert_allclose(velocity.shift, SHIFT, atol=0.01)


def test_depth_is_that_of_the_middle_row() -> None:
    bent, points = seen(READOUT_S)
    expected, _ = seen(0.0)
    colour = np.repeat(painted(points)[..., None], 3, axis=2)
    image = GroundImage(IMAGE_NS, colour, bent.astype(np.float32))
    found = following().ground(image)
    error = np.abs(found.depth - expected)
    known = np.isfinite(error)
    assert known[8:-8, 8:-8].all()
    # The nearest pixel of a leaning plane is off by its slope over half a pixel.
    slope = np.hypot(*np.gradient(expected)).max()
    assert error[known].max() < slope
    assert np.median(error[known]) < 0.3 * np.median(np.abs(bent - expected))
    assert (
        np.abs(found.colour[8:-8, 8:-8, 0].astype(int) - painted(seen(0.0)[1])[8:-8, 8:-8]).max()
        < 12
    )


def test_grey_by_the_middle_depth_loses_most_of_the_bend() -> None:
    depth, points = seen(READOUT_S)
    found = following().mav(MavImage(IMAGE_NS, painted(points)), (depth.min(), depth.max()))
    expected = painted(seen(0.0)[1])
    inner = (slice(8, -8), slice(8, -8))
    before = np.abs(painted(points).astype(int) - expected)[inner].mean()
    after = np.abs(found.astype(int) - expected)[inner].mean()
    assert after < 0.25 * before


def test_without_depth_a_turn_alone_is_removed() -> None:
    points = seen(READOUT_S)[1]
    found = following().mav(MavImage(IMAGE_NS, painted(points)), None)
    expected = painted(seen(0.0)[1])
    assert (
        np.abs(found.astype(int) - expected).mean()
        < np.abs(painted(points).astype(int) - expected).mean()
    )


@pytest.mark.parametrize("case", ["global shutter", "no image before", "long ago", "lost"])
def test_an_image_stays_as_it_is(case: str) -> None:
    straight = following(0.0 if case == "global shutter" else READOUT_S)
    stamp_ns = IMAGE_NS + (10**9 if case == "long ago" else 0)
    if case == "no image before":
        straight = StraightImages(calibration(READOUT_S))
    if case == "lost":
        straight = StraightImages(calibration(READOUT_S))
        straight.follow(0, TrackedPose(0, Tracking.LOST, None))
        straight.follow(IMAGE_NS, TrackedPose(IMAGE_NS, Tracking.TRACKED, SE3.identity()))
    depth, points = seen(READOUT_S)
    grey = MavImage(stamp_ns, painted(points))
    assert straight.mav(grey, (1.0, 2.0)) is grey.image
    pair = GroundImage(stamp_ns, cv2.merge([grey.image] * 3), depth.astype(np.float32))
    assert straight.ground(pair) is pair


def test_a_corrected_pose_is_no_motion() -> None:
    straight = following()
    jump = TrackedPose(2 * IMAGE_NS, Tracking.TRACKED, SE3.identity(), corrected=True)
    straight.follow(2 * IMAGE_NS, jump)
    points = seen(READOUT_S)[1]
    grey = painted(points)
    one = following().mav(MavImage(IMAGE_NS, grey), (1.0, 1.4))
    other = straight.mav(MavImage(2 * IMAGE_NS, grey), (1.0, 1.4))
    np.testing.assert_array_equal(one, other)
