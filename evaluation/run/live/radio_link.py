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
"""Longest wait to be sent [s], 15 frames at 30 Hz; a message that would wait longer is lost."""


@dataclass(frozen=True)
class RadioLimits:
    """Limits of a link.

    Attributes:
        mbit_s: Rate [Mbit/s]; infinite without a limit.
        latency_ms: Time from the end of sending to arrival [ms].
        loss: Share of messages lost at random, 0 to 1.
        jpeg_quality: JPEG quality of the images sent, 1 to 100.
    """

    mbit_s: float = math.inf
    latency_ms: float = 0.0
    loss: float = 0.0
    jpeg_quality: int = 90

    def describe(self) -> str:
        """Label such as "8 Mbit/s, 40 ms, 2 % lost, JPEG 90"."""
        rate = "unlimited" if math.isinf(self.mbit_s) else f"{self.mbit_s:g} Mbit/s"
        lost = f"{100 * self.loss:g} % lost"
        return f"{rate}, {self.latency_ms:g} ms, {lost}, JPEG {self.jpeg_quality}"


class Radio:
    """Carries one message after the other; `carried_bytes` counts all messages sent, lost ones
    too."""

    def __init__(self, limits: RadioLimits, rng: np.random.Generator) -> None:
        self._limits, self._rng = limits, rng
        self._free_ns = 0
        self.carried_bytes = 0

    def transmit(self, stamp_ns: int, size_bytes: int) -> int | None:
        """Arrival time of a message offered at `stamp_ns` [ns]; None if it is lost."""
        is_lost = self._rng.random() < self._limits.loss
        start_ns = max(stamp_ns, self._free_ns)
        if start_ns - stamp_ns > TRANSMIT_BUFFER_S * 1e9:
            return None
        self.carried_bytes += size_bytes
        # Bits over Mbit/s are microseconds.
        self._free_ns = start_ns + round(8 * size_bytes / self._limits.mbit_s * 1e3)
        if is_lost:
            return None
        return self._free_ns + round(self._limits.latency_ms * 1e6)


ENVELOPE = struct.Struct("<?qq")
"""Binary form of `Envelope`."""


@dataclass(frozen=True)
class Envelope:
    """Header of a message.

    Attributes:
        last: Whether this is the last message, which holds the final trajectory.
        stamp_ns: Stamp of the image in it [ns].
        arrives_ns: Time at which it has crossed the radio [ns].
    """

    last: bool
    stamp_ns: int
    arrives_ns: int

    def around(self, parts: Parts) -> Parts:
        """The message behind its header."""
        return [ENVELOPE.pack(self.last, self.stamp_ns, self.arrives_ns), *parts]

    @classmethod
    def of(cls, parts: Sequence[bytes]) -> Envelope:
        """Header of a received message."""
        return cls(*ENVELOPE.unpack(parts[0]))


class Uplink:
    """Sends a robot's frames to the mapper, and counts those that do not reach it.

    Args:
        sender: The channel.
        radio: The radio; without limits on one computer.
        jpeg_quality: JPEG quality of the MAV's images; None if not compressed.

    Attributes:
        shed: Stamps of frames for which the mapper had no room [ns].
        lost: Stamps of frames that the radio lost [ns].
    """

    def __init__(self, sender: Sender, radio: Radio, jpeg_quality: int | None) -> None:
        self._sender, self._radio, self._jpeg_quality = sender, radio, jpeg_quality
        self._hand_over = HandOver()
        self._newest_ns = 0
        self.shed: list[int] = []
        self.lost: list[int] = []

    def offer(self, frame: TrackedFrame) -> None:
        """Send a frame, unless the mapper has no room for it."""
        if not self._sender.has_room():
            self.shed.append(frame.stamp_ns)
            self._hand_over.leave_out(frame)
            return
        frame = self._hand_over.pass_on(frame)
        parts = pack(frame, self._jpeg_quality)
        arrives_ns = self._radio.transmit(frame.stamp_ns, sum(map(len, parts)))
        if arrives_ns is None:
            self.lost.append(frame.stamp_ns)
            self._hand_over.leave_out(frame)
            return
        self._newest_ns = frame.stamp_ns
        self._sender.send(Envelope(False, frame.stamp_ns, arrives_ns).around(parts))

    def close(self, final: Trajectory | None) -> None:
        """Send the final trajectory as the last message."""
        envelope = Envelope(True, self._newest_ns, self._newest_ns)
        self._sender.send(envelope.around(pack_trajectory(final)))
        self._sender.close()
