"""A recording's world and cameras built anew, to draw more images of the same flight."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from airground.core.scratch_folder import ScratchFolder
from airground.errors import AirgroundError, InputError
from airground.io.layout import TRUTH
from airground.io.recording_folder import RecordingFolder
from sim.recording.frames import FrameMaker, FramePlan
from sim.recording.recorder import Flight, with_models, write_all_but_images
from sim.recording.truth import Truth
from sim.robots.motion import Robot

_OTHERS = (
    "was it recorded with another scene file (give --scene FILE), by another version of the "
    "simulator, or on another kind of machine?"
)


@contextmanager
def redrawn(
    recording: RecordingFolder, flight: Flight, robots: Sequence[Robot]
) -> Iterator[FramePlan]:
    """The plan of a recording's images, with its worlds, which last as long as the context.

    Images are drawn from the stored motion and true calibration. The first image of each robot is
    drawn and compared with the recorded one, pixel by pixel.

    Args:
        recording: The recording, with its truth and its image files.
        flight: What it was made from.
        robots: Robots whose images are compared.

    Raises:
        InputError: The flight does not give this recording.
        AirgroundError: The folder for temporary files cannot hold the worlds.
    """
    with ScratchFolder() as folder:
        root = folder.path
        try:
            header, plan, plain = write_all_but_images(root, flight)
            stated = recording.header
            for key in ("scene", "seed", "flight", "duration_s", "frames"):
                if getattr(header, key) != getattr(stated, key):
                    raise InputError(
                        f"{recording.path}: made anew, it has another {key}: {_OTHERS}"
                    )
            plan = with_models(plan, plain)
        except OSError as error:
            raise AirgroundError(f"{root}: the worlds cannot be stored there: {error}") from None
        true = Truth.open(recording.path).calibration
        plan = replace(plan, motion=recording.path / TRUTH / "motion.npz", true=true)
        _check_first_images(recording, plan, robots)
        yield plan


def _check_first_images(
    recording: RecordingFolder, plan: FramePlan, robots: Sequence[Robot]
) -> None:
    with FrameMaker(plan) as maker:
        for robot in robots:
            images = recording.images
            stored = images.mav(0) if robot == "mav" else images.ground(0)[0]
            off = np.abs(maker.picture(robot, 0).astype(int) - stored)
            if off.any():
                raise InputError(
                    f"{recording.path}: drawn anew, the first {robot} image differs by up to "
                    f"{off.max()} grey levels in {100 * (off > 0).mean():.1f} % of the values: "
                    f"{_OTHERS}"
                )
