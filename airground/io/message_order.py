"""The order in which one robot's messages reach the pipeline."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from airground.core.cloud import Source
from airground.core.messages import GroundImage, ImuSamples, MagneticSamples, MavImage, Stamped


@dataclass
class Bundler:
    """Puts each image behind the samples since the one before it.

    There is one message with inertial and one with magnetic samples, unless there are none.
    An image that nobody takes leaves its samples to the next.

    Attributes:
        robot: Whose messages these are.
        imu, magnetic: All samples of its sensors; None where it has no such sensor.
    """

    robot: Source
    imu: ImuSamples | None
    magnetic: MagneticSamples | None
    _previous_ns: int = np.iinfo(np.int64).min

    def bundle(self, image: MavImage | GroundImage) -> list[Stamped]:
        """The messages that end with this image."""
        bundle = []
        if self.imu is not None:
            inertial = self.imu.between(self._previous_ns, image.stamp_ns)
            if len(inertial.stamps_ns):
                bundle.append(Stamped(self.robot, inertial))
        if self.magnetic is not None:
            magnetic = self.magnetic.between(self._previous_ns, image.stamp_ns)
            if len(magnetic.stamps_ns):
                bundle.append(Stamped(self.robot, magnetic))
        bundle.append(Stamped(self.robot, image))
        self._previous_ns = image.stamp_ns
        return bundle


def bundles(
    robot: Source,
    images: Iterable[MavImage | GroundImage],
    imu: ImuSamples | None,
    magnetic: MagneticSamples | None,
) -> Iterator[tuple[int, list[Stamped]]]:
    """Each image after the samples since the one before it; the image's stamp comes first."""
    bundler = Bundler(robot, imu, magnetic)
    for image in images:
        yield image.stamp_ns, bundler.bundle(image)
