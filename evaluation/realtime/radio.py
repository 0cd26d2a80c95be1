"""A radio link with a limited rate, a latency and losses, simulated in recorded time.

What it loses depends only on its seed and on what is sent when, never on how fast this
machine is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

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
