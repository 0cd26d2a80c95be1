"""The mapper's inputs: frames of both robots, merged into order of time as they arrive."""

from __future__ import annotations

import struct
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping

from airground.core.cloud import Source
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.link.channel import Receiver
from airground.link.frame_codec import Parts, unpack, unpack_trajectory
from airground.tracking import HandOver, TrackedFrame
from evaluation.run.live.playback import Clock
from evaluation.run.live.radio_link import Envelope

POLL_S = 0.02
"""Longest wait for a message before both channels are read again: less than a frame at 30 Hz."""

GIVE_UP_S = 120.0
"""Longest silence of both robots: SLAM may take that long to adjust its final map."""


class Stream:
    """Messages of one robot.

    Args:
        receiver: The channel.
        is_alive: Whether the robot's process still runs.

    Attributes:
        final: Final trajectory of the robot; None before it arrived.
        late_ns: Stamps of frames that arrived after a newer frame was taken [ns].
        malformed: Number of messages that were none of a robot's, and were dropped.
    """

    def __init__(self, receiver: Receiver, is_alive: Callable[[], bool]) -> None:
        self._receiver, self._is_alive = receiver, is_alive
        self._waiting: deque[tuple[Envelope, Parts]] = deque()
        self._hand_over = HandOver()
        self._ended = False
        self.final: Trajectory | None = None
        self.late_ns: list[int] = []
        self.malformed = 0

    def read(self) -> None:
        """Read all messages that the channel holds."""
        alive = self._is_alive()  # before reading, so that a process's last messages are read
        while (message := self._receiver.receive()) is not None:
            try:
                self._sort_in(Envelope.of(message), message[1:])
            except (InputError, struct.error, IndexError):
                self.malformed += 1
        self._ended |= not alive

    def _sort_in(self, envelope: Envelope, parts: Parts) -> None:
        if envelope.last:
            self.final, self._ended = unpack_trajectory(parts), True
        else:
            self._waiting.append((envelope, parts))

    def stamp_ns(self, now_ns: int) -> int | None:
        """Stamp of the next frame [ns]; None until it has crossed the radio."""
        if self._waiting and self._waiting[0][0].arrives_ns <= now_ns:
            return self._waiting[0][0].stamp_ns
        return None

    def has_ended(self) -> bool:
        """Whether no further frame will arrive."""
        return self._ended and not self._waiting

    def take(self, newest: tuple[int, Source]) -> TrackedFrame | None:
        """The next frame; None if it is malformed, or older than the newest frame taken."""
        _, parts = self._waiting.popleft()
        self._receiver.acknowledge()
        try:
            frame = unpack(parts)
        except InputError:
            self.malformed += 1
            return None
        if (frame.stamp_ns, frame.robot) < newest:
            self.late_ns.append(frame.stamp_ns)
            self._hand_over.leave_out(frame)
            return None
        return self._hand_over.pass_on(frame)

    def wait(self, seconds: float) -> None:
        """Wait for a message, at most this long [s]."""
        self._receiver.wait(seconds)


def in_order(
    streams: Mapping[Source, Stream], clock: Clock, patience_s: float
) -> Iterator[TrackedFrame]:
    """Frames by their stamps, the ground robot's first where stamps are equal.

    A frame waits for the other robot's next frame, which may be older. After `patience_s` without
    it, the other robot counts as silent and no frame waits for it until it sends again; its frames
    that are older than the newest frame taken are late. Messages cross the radio by `clock`.
    """
    newest = (-1, Source.GROUND)
    silent: set[Source] = set()
    waiting_since = last_taken = time.monotonic()
    while True:
        for stream in streams.values():
            stream.read()
        now_ns, now_s = clock.now_ns(), time.monotonic()
        heads = {robot: stream.stamp_ns(now_ns) for robot, stream in streams.items()}
        ready = {robot: stamp for robot, stamp in heads.items() if stamp is not None}
        silent -= ready.keys()
        missing = [r for r, stream in streams.items() if r not in ready and not stream.has_ended()]
        if not ready and (not missing or now_s - last_taken > GIVE_UP_S):
            return
        if not ready:
            waiting_since = now_s
        elif now_s - waiting_since > patience_s:
            silent.update(missing)
        if not ready or not silent.issuperset(missing):
            streams[missing[0]].wait(POLL_S)
            continue
        key = min((stamp, robot) for robot, stamp in ready.items())
        frame = streams[key[1]].take(newest)
        if frame is not None:
            newest = key
            yield frame
        waiting_since = last_taken = time.monotonic()
