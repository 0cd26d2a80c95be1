"""The order in which one robot's messages reach the pipeline."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from airground.core.cloud import Source
from airground.core.messages import GroundImage, ImuSamples, MagneticSamples, MavImage, Stamped


def bundles(
    robot: Source,
    images: Iterable[MavImage | GroundImage],
    imu: ImuSamples | None,
    magnetic: MagneticSamples | None,
) -> Iterator[tuple[int, list[Stamped]]]:
    """Each image after the samples since the one before it; the image's stamp comes first.

    There is one message with inertial and one with magnetic samples, unless there are none.
    """
    previous = np.iinfo(np.int64).min
    for image in images:
        bundle = []
        if imu is not None:
            inertial = imu.between(previous, image.stamp_ns)
            if len(inertial.stamps_ns):
                bundle.append(Stamped(robot, inertial))
        if magnetic is not None:
            span = [previous, image.stamp_ns]
            low, high = np.searchsorted(magnetic.stamps_ns, span, side="right")
            if high > low:
                field = MagneticSamples(magnetic.stamps_ns[low:high], magnetic.field[low:high])
                bundle.append(Stamped(robot, field))
        bundle.append(Stamped(robot, image))
        yield image.stamp_ns, bundle
        previous = image.stamp_ns
