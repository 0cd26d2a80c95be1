"""The mapper's ear: frames of both robots in order of time, though they come as they come."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping

from airground.core.cloud import Source
from airground.core.trajectory import Trajectory
from airground.link.channel import Receiver
from airground.link.frame_codec import Parts, unpack, unpack_trajectory
from airground.tracking import HandOver, TrackedFrame
from evaluation.run.live.playback import Clock
from evaluation.run.live.radio_link import Envelope

POLL_S = 0.02
GIVE_UP_S = 120.0
"""When nobody has anything to tell, a robot may take so long to finish its own map."""


class Stream:
    """What one robot sends.

    Args:
        receiver: The channel.
        is_alive: Whether the robot's process still runs.

    Attributes:
        final: The robot's path as believed at last, once it has told.
        late_ns: Stamps of frames that came after the mapper had gone on without them.
    """

    def __init__(self, receiver: Receiver, is_alive: Callable[[], bool]) -> None:
        self._receiver, self._is_alive = receiver, is_alive
        self._waiting: deque[tuple[Envelope, Parts]] = deque()
        self._hand_over = HandOver()
        self._ended = False
        self.final: Trajectory | None = None
        self.late_ns: list[int] = []

    def listen(self) -> None:
        """Take in what has come."""
        alive = self._is_alive()  # asked first, so that a robot's last words are heard
        while (message := self._receiver.receive()) is not None:
            envelope, parts = Envelope.of(message), message[1:]
            if envelope.last:
                self.final, self._ended = unpack_trajectory(parts), True
            else:
                self._waiting.append((envelope, parts))
        self._ended |= not alive

    def stamp_ns(self, now_ns: int) -> int | None:
        """Of the next frame; None while it has not crossed the radio."""
        if self._waiting and self._waiting[0][0].arrives_ns <= now_ns:
            return self._waiting[0][0].stamp_ns
        return None

    def over(self) -> bool:
        """Whether nothing more will come."""
        return self._ended and not self._waiting

    def take(self, newest: tuple[int, Source]) -> TrackedFrame | None:
        """The next frame; None where it came too late to be put in order behind the newest."""
        _, parts = self._waiting.popleft()
        self._receiver.acknowledge()
        frame = unpack(parts)
        if (frame.stamp_ns, frame.robot) < newest:
            self.late_ns.append(frame.stamp_ns)
            self._hand_over.leave_out(frame)
            return None
        return self._hand_over.pass_on(frame)

    def wait(self, seconds: float) -> None:
        """Until something comes, but not for long."""
        self._receiver.wait(seconds)


def in_order(
    streams: Mapping[Source, Stream], clock: Clock, patience_s: float
) -> Iterator[TrackedFrame]:
    """Frames by their stamps, the ground robot's first where they are equal.

    A frame waits until the other robot's next one is there, since that may be older. A robot
    that is silent for too long is not waited for until it speaks again; what it sends of
    the time before is too late.

    Args:
        streams: Of both robots.
        clock: Says what has crossed the radio.
        patience_s: How long one robot is waited for.
    """
    newest = (-1, Source.GROUND)
    silent: set[Source] = set()
    waiting_since = heard = time.monotonic()
    while True:
        for stream in streams.values():
            stream.listen()
        now_ns, now_s = clock.now_ns(), time.monotonic()
        heads = {robot: stream.stamp_ns(now_ns) for robot, stream in streams.items()}
        come = {robot: stamp for robot, stamp in heads.items() if stamp is not None}
        silent -= come.keys()
        missing = [r for r, stream in streams.items() if r not in come and not stream.over()]
        if not come and (not missing or now_s - heard > GIVE_UP_S):
            return
        if not come:
            waiting_since = now_s
        elif now_s - waiting_since > patience_s:
            silent.update(missing)
        if not come or not silent.issuperset(missing):
            streams[missing[0]].wait(POLL_S)
            continue
        key = min((stamp, robot) for robot, stamp in come.items())
        frame = streams[key[1]].take(newest)
        if frame is not None:
            newest = key
            yield frame
        waiting_since = heard = time.monotonic()
