"""Answers come back from the log as they went in, to the last bit."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.core.se3 import SE3
from airground.slam.front_end import ScaleEstimate, TrackedCorners, TrackedPose, Tracking
from evaluation.table.tracking_log import RECORDS_A_CHUNK, AnswerLog

numbers = st.floats(allow_nan=False)
twists = st.lists(st.floats(-1.5, 1.5), min_size=6, max_size=6)
covariances = st.lists(numbers, min_size=36, max_size=36).map(lambda v: np.reshape(v, (6, 6)))


@st.composite
def answers(draw: st.DrawFn) -> TrackedPose:
    tracking = draw(st.sampled_from(Tracking))
    pose = SE3.exp(draw(twists)) if tracking is Tracking.TRACKED else None
    return TrackedPose(
        draw(st.integers(0, 2**62)),
        tracking,
        pose,
        draw(st.none() | covariances),
        draw(st.none() | st.builds(ScaleEstimate, numbers, st.booleans())),
        draw(st.none() | st.tuples(numbers, numbers)),
        draw(st.booleans()),
    )


def assert_same(kept: TrackedPose, said: TrackedPose) -> None:
    for name in ("stamp_ns", "tracking", "scale", "depth_range", "corrected"):
        assert getattr(kept, name) == getattr(said, name), name
    assert (kept.T_map_camera is None) == (said.T_map_camera is None)
    if kept.T_map_camera is not None and said.T_map_camera is not None:
        np.testing.assert_array_equal(kept.T_map_camera.matrix(), said.T_map_camera.matrix())
    assert (kept.covariance is None) == (said.covariance is None)
    if kept.covariance is not None and said.covariance is not None:
        np.testing.assert_array_equal(kept.covariance, said.covariance)


@settings(max_examples=50, deadline=None)
@given(st.lists(answers(), max_size=6))
def test_what_goes_in_comes_out_also_in_another_process(said: list[TrackedPose]) -> None:
    log = AnswerLog(said)
    assert len(log) == len(said)
    for kept, sent, one in zip(log, pickle.loads(pickle.dumps(log)), said, strict=True):
        assert_same(kept, one)
        assert_same(sent, one)


def test_many_answers_keep_their_order_and_little_memory() -> None:
    count = 2 * RECORDS_A_CHUNK + 5
    log = AnswerLog(
        TrackedPose(stamp, Tracking.TRACKED, SE3.identity(), np.eye(6)) for stamp in range(count)
    )
    assert [answer.stamp_ns for answer in log] == list(range(count))
    assert [answer.stamp_ns for answer in log[-3:]] == [count - 3, count - 2, count - 1]
    assert log[-1].stamp_ns == count - 1
    assert len(pickle.dumps(log)) < 600 * (count + RECORDS_A_CHUNK)
    for outside in (count, -count - 1):
        with pytest.raises(IndexError, match=f"of {count}"):
            log[outside]


def test_corners_are_not_kept() -> None:
    """They are most of an answer's bytes, and a long recording has many answers."""
    corners = TrackedCorners(np.zeros((3, 2), np.float32), np.array([True, False, True]))
    said = TrackedPose(5, Tracking.TRACKED, SE3.identity(), corners=corners)
    (kept,) = AnswerLog([said])
    assert kept.corners is None
    assert_same(kept, said)
