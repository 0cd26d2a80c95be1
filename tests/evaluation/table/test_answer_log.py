"""Answers come back from the log as they went in, to the last bit."""

from __future__ import annotations

import pickle
import tempfile
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.core.se3 import SE3
from airground.errors import AirgroundError
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
    assert len(pickle.dumps(log)) < 450 * count
    sent = pickle.loads(pickle.dumps(log))
    assert [answer.stamp_ns for answer in sent] == list(range(count))
    sent.append(log[0])
    assert (len(sent), len(log)) == (count + 1, count)
    assert sent[-1].stamp_ns == 0
    for outside in (count, -count - 1):
        with pytest.raises(IndexError, match=f"of {count}"):
            log[outside]


def test_memory_does_not_grow_with_the_answers() -> None:
    answer = TrackedPose(1, Tracking.TRACKED, SE3.identity(), np.eye(6))
    log = AnswerLog([answer] * RECORDS_A_CHUNK)
    tracemalloc.start()
    for _ in range(10 * RECORDS_A_CHUNK):
        log.append(answer)
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 1.5 * 420 * RECORDS_A_CHUNK


def test_no_room_for_temporary_files_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(buffering: int) -> object:
        return Path("/dev/full").open("wb", buffering=buffering)

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    answer = TrackedPose(1, Tracking.LOST, None)
    with pytest.raises(AirgroundError, match=r"No space left on device; set TMPDIR"):
        AnswerLog([answer] * RECORDS_A_CHUNK)


def test_corners_are_not_kept() -> None:
    """They are most of an answer's bytes, and a long recording has many answers."""
    corners = TrackedCorners(np.zeros((3, 2), np.float32), np.array([True, False, True]))
    said = TrackedPose(5, Tracking.TRACKED, SE3.identity(), corners=corners)
    (kept,) = AnswerLog([said])
    assert kept.corners is None
    assert_same(kept, said)
