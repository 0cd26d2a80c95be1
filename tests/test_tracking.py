"""What trackers hand over, and what becomes of corrections when frames are left out."""

from __future__ import annotations

from airground.core.cloud import Source
from airground.tracking import without
from tests.frames import ground_frame, mav_frame, path


def test_a_frame_left_out_leaves_its_correction_to_the_next_of_its_robot() -> None:
    first, second = path(1), path(2)
    frames = [ground_frame(1, first), ground_frame(2, second), mav_frame(2), ground_frame(3)]
    kept = list(without(frames, {Source.GROUND: {1, 2}}))
    assert [(frame.robot, frame.stamp_ns) for frame in kept] == [
        (Source.MAV, 2),
        (Source.GROUND, 3),
    ]
    assert kept[0].trajectory is None
    assert kept[1].trajectory is second


def test_a_newer_correction_replaces_one_that_was_left_over() -> None:
    old, new = path(1), path(2)
    frames = [ground_frame(1, old), ground_frame(2, new), ground_frame(3)]
    kept = list(without(frames, {Source.GROUND: {1}}))
    assert [frame.trajectory for frame in kept] == [new, None]
