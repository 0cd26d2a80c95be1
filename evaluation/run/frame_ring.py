"""Tracked frames on their way to another process, their images in memory that both see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext

import numpy as np
from numpy.typing import DTypeLike, NDArray

from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.core.trajectory import Trajectory
from airground.slam.front_end import TrackedPose
from airground.tracking import TrackedFrame

PIXEL_BYTES = {Source.MAV: 1, Source.GROUND: 3 + 4}
"""Grey; colour and depth."""


@dataclass(frozen=True)
class Handed:
    """All of a frame but the pixels.

    Attributes:
        slot: Where the pixels lie in the ring.
        shapes: Of the image, or of colour and depth.
    """

    slot: int
    shapes: tuple[tuple[int, ...], ...]
    stamp_ns: int
    pose: TrackedPose
    north_rad: float | None
    trajectory: Trajectory | None


class FrameRing:
    """As many slots as frames may be under way; who puts one in waits for a free slot.

    A pipe alone would copy every image four times.

    Args:
        context: Of the processes.
        slots: How many.
        robot: Whose frames they are.
        pixels: Of its images.
    """

    def __init__(self, context: SpawnContext, slots: int, robot: Source, pixels: int) -> None:
        self._slots, self._slot_bytes = slots, pixels * PIXEL_BYTES[robot]
        self._memory = context.RawArray("B", slots * self._slot_bytes)
        self._free = context.Semaphore(slots)
        self._put = 0

    @property
    def memory_mib(self) -> float:
        """Of all slots; both processes count it as theirs."""
        return self._slots * self._slot_bytes / 2**20

    def put(self, frame: TrackedFrame, pipe: Connection) -> None:
        """Hand a frame over, as soon as there is room."""
        image = frame.image
        arrays: Sequence[NDArray] = (
            [image.image] if isinstance(image, MavImage) else [image.colour, image.depth]
        )
        self._free.acquire()
        slot = self._put % self._slots
        shapes = tuple(array.shape for array in arrays)
        for target, array in zip(self._views(slot, shapes), arrays, strict=True):
            np.copyto(target, array)
        pipe.send(
            Handed(slot, shapes, frame.stamp_ns, frame.pose, frame.north_rad, frame.trajectory)
        )
        self._put += 1

    def take(self, handed: Handed) -> TrackedFrame:
        """The frame that was handed over; its slot is free again."""
        arrays = [view.copy() for view in self._views(handed.slot, handed.shapes)]
        self._free.release()
        image: MavImage | GroundImage
        if len(arrays) == 1:
            image = MavImage(handed.stamp_ns, arrays[0])
        else:
            image = GroundImage(handed.stamp_ns, arrays[0], arrays[1])
        return TrackedFrame(image, handed.pose, handed.north_rad, handed.trajectory)

    def _views(self, slot: int, shapes: Sequence[tuple[int, ...]]) -> list[NDArray]:
        """Arrays of these shapes in a slot: grey, or colour and depth."""
        types: tuple[DTypeLike, ...] = (np.float32, np.uint8) if len(shapes) == 2 else (np.uint8,)
        start = slot * self._slot_bytes
        views = []
        # Depth first: so it begins at a multiple of its four bytes.
        for dtype, shape in zip(types, reversed(shapes), strict=True):
            count = int(np.prod(shape))
            view = np.frombuffer(self._memory, dtype, count, start)
            views.append(view.reshape(shape))
            start += view.nbytes
        return views[::-1]
