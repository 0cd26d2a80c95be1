"""Frames that reach the mapper live are those of a run offline with the same drop list."""

from __future__ import annotations

import numpy as np
import pytest

from airground.core.cloud import Source
from airground.io.recording import Recording
from evaluation.run.drops import nothing_dropped
from evaluation.run.live.radio_link import RadioLimits
from tests.evaluation.run.played_robots import Robots, offline, packed
from tests.io.recordings import GROUND_STAMPS, MAV_STAMPS, SAMPLE_STAMPS, write_recording

MS = 1_000_000


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return Recording.open(write_recording(tmp_path_factory.mktemp("live") / "recording"))


def test_without_drops_frames_equal_those_of_a_run_offline(recording: Recording) -> None:
    robots = Robots(recording)
    robots.play()
    frames = robots.received()
    assert [frame.stamp_ns for frame in frames] == sorted([*MAV_STAMPS, *GROUND_STAMPS])
    assert robots.drops() == nothing_dropped(recording)
    assert packed(frames) == packed(offline(recording, nothing_dropped(recording)))
    assert any(frame.trajectory is not None for frame in frames)


def test_a_slow_tracker_drops_images_and_no_inertial_sample(recording: Recording) -> None:
    robots = Robots(recording, {Source.MAV: 60 * MS})
    robots.play()
    assert robots.played[Source.MAV].dropped_ns == [MAV_STAMPS[1], MAV_STAMPS[3]]
    assert robots.played[Source.GROUND].dropped_ns == []
    seen = robots.front_ends[Source.MAV].imu_stamps
    assert seen == SAMPLE_STAMPS[MAV_STAMPS[2] >= SAMPLE_STAMPS].tolist()
    frames = robots.received()
    assert packed(frames) == packed(offline(recording, robots.drops()))
    assert packed(frames) != packed(offline(recording, nothing_dropped(recording)))


def test_the_latency_of_poses_is_that_of_the_tracker(recording: Recording) -> None:
    robots = Robots(recording, {Source.MAV: 60 * MS}, waiting_frames=4)
    robots.play()
    posed = robots.played[Source.MAV].posed_ns
    late = [posed[stamp] - stamp for stamp in MAV_STAMPS.tolist()]
    assert late[0] == 60 * MS
    assert np.diff(late) == pytest.approx(np.full(3, 60 * MS - 33_333_333), abs=2)
    assert robots.played[Source.MAV].longest_queue == 2


def test_a_full_mapper_blocks_no_tracker(recording: Recording) -> None:
    robots = Robots(recording, frames_under_way=2)
    robots.play()
    assert all(len(played.posed_ns) == 4 for played in robots.played.values())
    assert robots.uplinks[Source.GROUND].shed == GROUND_STAMPS[2:].tolist()
    frames = robots.received()
    assert len(frames) == 4
    assert packed(frames) == packed(offline(recording, robots.drops()))


def test_radio_losses_are_counted_and_reproduced_offline(recording: Recording) -> None:
    robots = Robots(recording, radio=RadioLimits(loss=0.5, latency_ms=30, jpeg_quality=70))
    robots.play()
    lost = robots.uplinks[Source.MAV].lost
    assert 0 < len(lost) < 4
    frames = robots.received()
    assert len(frames) == 8 - len(lost)
    assert packed(frames) == packed(offline(recording, robots.drops()))
