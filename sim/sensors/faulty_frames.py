"""What failing cameras make of the frames that a robot's camera would have taken."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import freeze
from sim.sensors.faults import Fault, said_stamps


@dataclass(frozen=True, eq=False)
class FaultyFrames:
    """The frames of one robot that are left, each made from one that was taken.

    Attributes:
        stamps_ns: (N,) stamps as the robot's clock has them [ns].
        taken: (N,) number of the frame that each shows, among those without faults.
        gain: (N,) factor on the grey levels.
        depth: (N,) whether the frame has depth.
    """

    stamps_ns: NDArray[np.int64]
    taken: NDArray[np.int64]
    gain: NDArray[np.float64]
    depth: NDArray[np.bool_]

    def __post_init__(self) -> None:
        count = len(self.stamps_ns)
        for name, dtype in (
            ("stamps_ns", np.int64),
            ("taken", np.int64),
            ("gain", np.float64),
            ("depth", np.bool_),
        ):
            freeze(self, name, (count,), dtype)

    @classmethod
    def of(cls, stamps_ns: NDArray[np.int64], faults: Sequence[Fault]) -> FaultyFrames:
        """The frames of a robot with stamps (M,) [ns] and with its placed faults."""
        count = len(stamps_ns)
        taken, gain = np.arange(count), np.ones(count)
        there, depth = np.ones(count, bool), np.ones(count, bool)
        for fault in faults:
            rows = np.flatnonzero(fault.during(stamps_ns))
            if fault.kind == "dropped":
                there[rows] = False
            elif fault.kind in ("black", "carried"):
                gain[rows] = 0.0
            elif fault.kind == "exposure":
                gain[rows] *= fault.strength
            elif fault.kind == "frozen":
                taken[rows] = max(int(rows[0]) - 1, 0) if len(rows) else 0
            elif fault.kind == "repeated":
                taken[rows[1::2]] -= 1
            if fault.kind in ("depth_gone", "carried"):
                depth[rows] = False
        said, in_time = said_stamps(stamps_ns, faults)
        kept = there & in_time
        return cls(said[kept], taken[kept], gain[kept], depth[kept])

    def image(self, index: int, taken: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """The image of a frame, from the one that was taken."""
        gain = float(self.gain[index])
        if gain == 1.0:
            return taken
        return np.clip(np.rint(gain * taken), 0, 255).astype(np.uint8)

    def depth_units(self, index: int, taken: NDArray[np.uint16]) -> NDArray[np.uint16]:
        """The depth image of a frame, from the one that was taken; 0 is missing."""
        return taken if self.depth[index] else np.zeros_like(taken)
