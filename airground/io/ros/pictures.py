"""The frames of a bag: colour and depth that belong together, read when they are needed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from airground.core.arrays import F32, I64, U8, U16, Mask
from airground.core.messages import GroundImage, MavImage
from airground.errors import RecordingError
from airground.io.depth_scale import SAMPLES, DepthScale
from airground.io.lens import Lens, Undistortion
from airground.io.ros import images
from airground.io.ros.bag import Bag, Messages, Topic
from airground.io.ros.samples import Stamped, read_stamps
from airground.io.ros.topics import Chosen
from airground.io.tum_lists import MAX_DIFFERENCE_NS, associate


@dataclass(frozen=True, eq=False)
class Frames:
    """Which messages make the frames of a bag.

    Attributes:
        stamps_ns: (N,) stamps of the images [ns].
        image: (N,) index of each frame's image among the messages of its topic.
        depth: (N,) the same of its depth; equal to `image` without depth.
        images, depths: Stamps of all messages of both topics; `depths` is None without depth.
    """

    stamps_ns: I64
    image: I64
    depth: I64
    images: Stamped
    depths: Stamped | None

    def where(self, kept: Mask) -> Frames:
        """Those frames of which `kept` (N,) is true."""
        return replace(
            self, stamps_ns=self.stamps_ns[kept], image=self.image[kept], depth=self.depth[kept]
        )


def read_frames(bag: Bag, chosen: Chosen) -> Frames:
    """Pair colour and depth, at most 20 ms apart; RecordingError where nothing fits."""
    colour = read_stamps(bag, chosen.image.name)
    if chosen.depth is None:
        return Frames(colour.stamps_ns, colour.order, colour.order, colour, None)
    depth = read_stamps(bag, chosen.depth.name)
    i, j = associate(colour.stamps_ns, depth.stamps_ns, MAX_DIFFERENCE_NS)
    if len(i) == 0:
        raise RecordingError(
            f"{bag.path}: no image of {chosen.depth.name} is within 20 ms of one of "
            f"{chosen.image.name}; both must be stamped by the same clock"
        )
    return Frames(colour.stamps_ns[i], colour.order[i], depth.order[j], colour, depth)


class Pictures:
    """Reads frames; errors name the bag, the topic and what is wrong."""

    def __init__(
        self,
        path: Path,
        chosen: Chosen,
        frames: Frames,
        lens: Lens,
        undistortion: Undistortion,
        scale: DepthScale,
    ) -> None:
        self._path, self._lens, self._scale = path, lens, scale
        self._frames, self._undistortion = frames, undistortion
        self._image, self._depth = chosen.image, chosen.depth
        self._images = Messages(path, chosen.image.name, frames.images.times_ns)
        self._depths: Messages | None = None
        if chosen.depth is not None and frames.depths is not None:
            self._depths = Messages(path, chosen.depth.name, frames.depths.times_ns)

    def grey(self, index: int) -> MavImage:
        """The image of a frame, in grey."""
        image = self._pixels(index)
        if image.ndim == 3:
            image = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
        return MavImage(int(self._frames.stamps_ns[index]), self._undistortion.image(image))

    def registered(self, index: int) -> GroundImage:
        """Colour and depth of a frame."""
        colour = self._pixels(index)
        if colour.ndim != 3:
            raise self._error(self._image, "has no colours, which the ground robot needs")
        depth = images.to_metres(self._units(index), self._scale.units_per_m)
        stamp_ns = int(self._frames.stamps_ns[index])
        straight = self._undistortion
        return GroundImage(stamp_ns, straight.image(colour), straight.depth(depth))

    def check_scale(self) -> bool:
        """Check the depth scale, as of folders; returns whether depth has one: metres have none."""
        last = len(self._frames.stamps_ns) - 1
        indices = np.unique(np.linspace(0, last, min(SAMPLES, last + 1)).astype(int)).tolist()
        found = [self._units(index) for index in indices]
        if any(units.dtype != np.uint16 for units in found):
            return False
        assert self._depth is not None
        values = np.concatenate([units[units > 0] for units in found]).astype(np.uint16)
        self._scale.check(values, Path(f"{self._path}: {self._depth.name}"))
        return True

    def _pixels(self, index: int) -> U8:
        message = self._images[int(self._frames.image[index])]
        try:
            return images.pixels(message, self._image.kind, self._lens.width, self._lens.height)
        except ValueError as error:
            raise self._error(self._image, str(error)) from None

    def _units(self, index: int) -> U16 | F32:
        assert self._depth is not None
        assert self._depths is not None
        message, kind = self._depths[int(self._frames.depth[index])], self._depth.kind
        width, height = self._lens.width, self._lens.height
        try:
            found = images.size(message, kind)
            if found != (width, height):
                raise ValueError(
                    f"depth is {found[0]}x{found[1]}, its colour image is {width}x{height}; depth "
                    "must be registered to the colour image and of its size"
                )
            return images.depth_units(message, kind, width, height)
        except ValueError as error:
            raise self._error(self._depth, str(error)) from None

    def _error(self, topic: Topic, what: str) -> RecordingError:
        return RecordingError(f"{self._path}: {topic.name}: {what}")
