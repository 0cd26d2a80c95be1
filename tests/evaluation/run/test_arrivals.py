"""Frames of two robots, merged into order of time as they arrive."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest

from airground.core.cloud import Source
from airground.link.channel import Receiver, Sender
from airground.link.frame_codec import pack, pack_trajectory
from airground.tracking import TrackedFrame
from evaluation.run.live.arrivals import Stream, in_order
from evaluation.run.live.radio_link import Envelope
from tests.evaluation.run.played_robots import SteppedClock
from tests.frames import ground_frame, mav_frame, path


@dataclass
class ScriptedRobot:
    """A robot that sends the frames that the test gives it."""

    alive: bool = True
    receiver: Receiver = field(default_factory=Receiver)

    def __post_init__(self) -> None:
        self.sender = Sender(self.receiver.address, 100)
        self.stream = Stream(self.receiver, lambda: self.alive)

    def send(self, frame: TrackedFrame, arrives_ns: int = 0) -> None:
        self.sender.send(Envelope(False, frame.stamp_ns, arrives_ns).around(pack(frame)))
        assert self.receiver.wait(5)
        self.stream.read()

    def end(self) -> None:
        self.sender.send(Envelope(True, 0, 0).around(pack_trajectory(path(2))))

    def close(self) -> None:
        self.sender._socket.close(linger=0)
        self.receiver.close()


@pytest.fixture
def robots() -> Iterator[dict[Source, ScriptedRobot]]:
    made = {robot: ScriptedRobot() for robot in Source}
    yield made
    for one in made.values():
        one.close()


def taken(
    robots: dict[Source, ScriptedRobot], clock: SteppedClock, patience_s: float = 30.0
) -> Iterator[tuple[str, int]]:
    streams = {robot: one.stream for robot, one in robots.items()}
    for frame in in_order(streams, clock, patience_s):
        yield frame.robot.name, frame.stamp_ns


def test_frames_are_ordered_by_stamp_the_ground_robots_first(
    robots: dict[Source, ScriptedRobot],
) -> None:
    for stamp in (10, 20, 30):
        robots[Source.MAV].send(mav_frame(stamp))
    for stamp in (5, 20, 25):
        robots[Source.GROUND].send(ground_frame(stamp))
    for one in robots.values():
        one.end()
    order = [("GROUND", 5), ("MAV", 10), ("GROUND", 20), ("MAV", 20), ("GROUND", 25), ("MAV", 30)]
    assert list(taken(robots, SteppedClock())) == order
    assert robots[Source.GROUND].stream.final is not None


def test_a_silent_robot_delays_no_frame_and_its_late_frames_are_counted(
    robots: dict[Source, ScriptedRobot],
) -> None:
    robots[Source.GROUND].send(ground_frame(5))
    robots[Source.GROUND].send(ground_frame(20))
    frames = taken(robots, SteppedClock(), patience_s=0.05)
    assert [next(frames), next(frames)] == [("GROUND", 5), ("GROUND", 20)]
    robots[Source.MAV].send(mav_frame(10))
    robots[Source.MAV].send(mav_frame(30))
    for one in robots.values():
        one.end()
    assert list(frames) == [("MAV", 30)]
    assert robots[Source.MAV].stream.late_ns == [10]


def test_a_dead_robot_delays_no_frame(robots: dict[Source, ScriptedRobot]) -> None:
    robots[Source.MAV].send(mav_frame(10))
    robots[Source.MAV].alive = False
    for stamp in (5, 20):
        robots[Source.GROUND].send(ground_frame(stamp))
    robots[Source.GROUND].end()
    order = [("GROUND", 5), ("MAV", 10), ("GROUND", 20)]
    assert list(taken(robots, SteppedClock())) == order


def test_a_frame_is_ready_after_crossing_the_radio(
    robots: dict[Source, ScriptedRobot],
) -> None:
    clock = SteppedClock()
    robots[Source.MAV].send(mav_frame(10), arrives_ns=1000)
    assert robots[Source.MAV].stream.stamp_ns(999) is None
    assert robots[Source.MAV].stream.stamp_ns(1000) == 10
    robots[Source.GROUND].send(ground_frame(20))
    frames = taken(robots, clock, patience_s=0.05)
    assert next(frames) == ("GROUND", 20)
    clock.wait_until(1000)
    for one in robots.values():
        one.end()
    assert list(frames) == []
    assert robots[Source.MAV].stream.late_ns == [10]


def test_malformed_messages_are_counted_and_dropped(robots: dict[Source, ScriptedRobot]) -> None:
    mav = robots[Source.MAV]
    for parts in (
        [b"xy"],
        Envelope(True, 5, 5).around([b"{", b""]),
        Envelope(False, 15, 0).around([b"no frame"]),
    ):
        mav.sender.send(parts)
        assert mav.receiver.wait(5)
        mav.stream.read()
    mav.send(mav_frame(20))
    for one in robots.values():
        one.end()
    assert list(taken(robots, SteppedClock())) == [("MAV", 20)]
    assert mav.stream.malformed == 3
    assert mav.stream.final is not None
