"""Frames survive the link to the last bit, and nothing else gets through."""

from __future__ import annotations

import json

import numpy as np
import pytest

from airground.core.messages import GroundImage, MavImage
from airground.errors import InputError
from airground.link.frame_codec import (
    as_received,
    pack,
    pack_trajectory,
    unpack,
    unpack_trajectory,
)
from airground.slam.front_end import TrackedPose, Tracking
from airground.tracking import TrackedFrame
from tests.frames import ground_frame, mav_frame, path


def assert_same(one: TrackedFrame, two: TrackedFrame) -> None:
    """To the bit, whatever a frame holds."""
    assert pack(one) == pack(two)
    assert one.robot == two.robot
    assert one.pose.tracking == two.pose.tracking
    assert one.pose.scale == two.pose.scale
    assert one.pose.depth_range == two.pose.depth_range
    assert one.pose.corrected == two.pose.corrected
    assert one.north_rad == two.north_rad
    if one.pose.T_map_camera is not None:
        assert two.pose.T_map_camera is not None
        both = one.pose.T_map_camera.matrix(), two.pose.T_map_camera.matrix()
        assert both[0].tobytes() == both[1].tobytes()


@pytest.mark.parametrize("sigma", [0.1, np.inf])
def test_a_mav_frame_survives(sigma: float) -> None:
    frame = mav_frame(7, sigma)
    received = unpack(pack(frame))
    assert_same(frame, received)
    assert isinstance(frame.image, MavImage)
    assert isinstance(received.image, MavImage)
    assert received.image.image.tobytes() == frame.image.image.tobytes()


def test_a_ground_frame_survives_with_its_correction() -> None:
    frame = ground_frame(7, path(5))
    received = unpack(pack(frame))
    assert_same(frame, received)
    assert isinstance(frame.image, GroundImage)
    assert isinstance(received.image, GroundImage)
    assert received.image.depth.tobytes() == frame.image.depth.tobytes()
    assert received.image.colour.tobytes() == frame.image.colour.tobytes()
    assert received.trajectory is not None
    assert received.trajectory.rotations.tobytes() == path(5).rotations.tobytes()


def test_a_lost_frame_has_no_pose() -> None:
    image = mav_frame(7).image
    frame = TrackedFrame(image, TrackedPose(7, Tracking.LOST, None))
    received = unpack(pack(frame))
    assert_same(frame, received)
    assert received.pose.T_map_camera is None
    assert received.pose.covariance is None


def test_the_mav_sends_what_as_received_says() -> None:
    frame = mav_frame(7)
    assert isinstance(frame.image, MavImage)
    received = unpack(pack(frame, 80)).image
    assert isinstance(received, MavImage)
    assert received.image.tobytes() == as_received(frame.image, 80).image.tobytes()
    off = received.image.astype(int) - frame.image.image
    assert 0 < np.abs(off).mean() < 4


@pytest.mark.parametrize("final", [None, path(3)])
def test_final_trajectories_survive(final) -> None:  # type: ignore[no-untyped-def]
    received = unpack_trajectory(pack_trajectory(final))
    assert (received is None) == (final is None)
    if final is not None:
        assert received is not None
        assert received.translations.tobytes() == final.translations.tobytes()


def test_what_is_no_frame_is_refused() -> None:
    good = pack(mav_frame(7))
    header = json.loads(good[0])
    header["arrays"][0][1] = "|O"
    wrong = [[b"{}"], [b"\xff"], good[:-1], [good[0], b"short", *good[2:]]]
    wrong += [[json.dumps(header).encode(), *good[1:]], []]
    for parts in wrong:
        with pytest.raises(InputError, match="link: not a tracked frame"):
            unpack(parts)
