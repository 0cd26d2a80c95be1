"""The radio link from a tracker to the mapper: rate, latency and losses, in recorded time."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from airground.core.trajectory import Trajectory
from airground.link.channel import Sender
from airground.link.frame_codec import Parts, pack, pack_trajectory
from airground.tracking import HandOver, TrackedFrame

TRANSMIT_BUFFER_S = 0.5
"""A message that would have to wait longer than this to be sent is given up."""


@dataclass(frozen=True)
class RadioLimits:
    """How bad a link is.

    Attributes:
        mbit_s: Rate [Mbit/s]; infinite where there is no limit.
        latency_ms: From the end of sending to the other side [ms].
        loss: Share of messages that vanish at random.
        jpeg_quality: Of the images sent, 1 to 100.
    """

    mbit_s: float = math.inf
    latency_ms: float = 0.0
    loss: float = 0.0
    jpeg_quality: int = 90

    def describe(self) -> str:
        """For labels: "8 Mbit/s, 40 ms, 2 % lost, JPEG 90"."""
        rate = "unlimited" if math.isinf(self.mbit_s) else f"{self.mbit_s:g} Mbit/s"
        lost = f"{100 * self.loss:g} % lost"
        return f"{rate}, {self.latency_ms:g} ms, {lost}, JPEG {self.jpeg_quality}"


class Radio:
    """Carries one message after the other.

    Args:
        limits: How bad it is.
        rng: Draws what vanishes.

    Attributes:
        carried_bytes: Of all messages that were sent, those included that vanished.
    """

    def __init__(self, limits: RadioLimits, rng: np.random.Generator) -> None:
        self._limits, self._rng = limits, rng
        self._free_ns = 0
        self.carried_bytes = 0

    def transmit(self, stamp_ns: int, size_bytes: int) -> int | None:
        """When a message offered at `stamp_ns` arrives [ns]; None where it never does."""
        vanishes = self._rng.random() < self._limits.loss
        start_ns = max(stamp_ns, self._free_ns)
        if start_ns - stamp_ns > TRANSMIT_BUFFER_S * 1e9:
            return None
        self.carried_bytes += size_bytes
        # Bits over Mbit/s are microseconds.
        self._free_ns = start_ns + round(8 * size_bytes / self._limits.mbit_s * 1e3)
        if vanishes:
            return None
        return self._free_ns + round(self._limits.latency_ms * 1e6)


ENVELOPE = struct.Struct("<?qq")
"""Whether this is the last message; the image's stamp; when the message arrives [ns]."""


@dataclass(frozen=True)
class Envelope:
    """What is written on a message.

    Attributes:
        last: Whether nothing comes after it: it holds the final trajectory.
        stamp_ns: Of the image in it.
        arrives_ns: When it has crossed the radio.
    """

    last: bool
    stamp_ns: int
    arrives_ns: int

    def around(self, parts: Parts) -> Parts:
        """The message in its envelope."""
        return [ENVELOPE.pack(self.last, self.stamp_ns, self.arrives_ns), *parts]

    @classmethod
    def of(cls, parts: Sequence[bytes]) -> Envelope:
        """What is written on a message that was received."""
        return cls(*ENVELOPE.unpack(parts[0]))


class Uplink:
    """Sends a robot's frames to the mapper, and counts those that it could not.

    Args:
        sender: The channel.
        radio: What lies in between; None where both are on one computer.
        jpeg_quality: Of the MAV's images, None where they are not compressed.

    Attributes:
        shed: Stamps of frames that the mapper had no room for [ns].
        lost: Stamps of frames that the radio lost [ns].
    """

    def __init__(self, sender: Sender, radio: Radio | None, jpeg_quality: int | None) -> None:
        self._sender, self._radio, self._jpeg_quality = sender, radio, jpeg_quality
        self._hand_over = HandOver()
        self._newest_ns = 0
        self.shed: list[int] = []
        self.lost: list[int] = []
        self._bytes = 0

    @property
    def sent_bytes(self) -> int:
        """How many bytes were sent, those that vanished on the way included."""
        return self._bytes if self._radio is None else self._radio.carried_bytes

    def offer(self, frame: TrackedFrame) -> None:
        """Send a frame, unless there is no room for it."""
        if not self._sender.has_room():
            self.shed.append(frame.stamp_ns)
            self._hand_over.leave_out(frame)
            return
        frame = self._hand_over.pass_on(frame)
        parts = pack(frame, self._jpeg_quality)
        size = sum(map(len, parts))
        arrives_ns: int | None = frame.stamp_ns
        if self._radio is not None:
            arrives_ns = self._radio.transmit(frame.stamp_ns, size)
        self._bytes += size
        if arrives_ns is None:
            self.lost.append(frame.stamp_ns)
            self._hand_over.leave_out(frame)
            return
        self._newest_ns = frame.stamp_ns
        self._sender.send(Envelope(False, frame.stamp_ns, arrives_ns).around(parts))

    def close(self, final: Trajectory | None) -> None:
        """Send the final trajectory; nothing comes after it."""
        envelope = Envelope(True, self._newest_ns, self._newest_ns)
        self._sender.send(envelope.around(pack_trajectory(final)))
        self._sender.close()
