"""All that is drawn of a run, from its events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from airground.core.cloud import Source
from airground.core.messages import RobotCalibration
from evaluation.rerun_view.curves import Curves
from evaluation.rerun_view.depth_maps import DepthMaps
from evaluation.rerun_view.images import Images
from evaluation.rerun_view.layout import layout
from evaluation.rerun_view.level import LEVELS, LevelName
from evaluation.rerun_view.localization import Localization
from evaluation.rerun_view.maps import Maps
from evaluation.rerun_view.messages import Messages
from evaluation.rerun_view.robots import Robots
from evaluation.rerun_view.sensor_stream import SensorStream
from evaluation.rerun_view.true_robots import TrueRobots
from evaluation.runs.onlooker import Onlooker, Seen
from sim.truth import Truth

RUN_FILE = "run.rrd"


class RunView:
    """An onlooker that writes a run for the viewer.

    Args:
        path: The .rrd file to write.
        name: Of what is run, as the viewer shows it.
        calibrations: Of both robots; they shape the frustums.
        truth: What is true; None leaves out errors and all else under `/truth`.
        level: How much is kept.
        viewer: Address of a viewer that listens; None for none.
    """

    def __init__(
        self,
        path: Path,
        name: str,
        calibrations: Mapping[Source, RobotCalibration],
        truth: Truth | None,
        level: LevelName = "stages",
        viewer: str | None = None,
    ) -> None:
        chosen = LEVELS[level]
        shown = layout(with_truth=truth is not None)
        self._stream = stream = SensorStream(path, name, shown, viewer)
        self._parts: Sequence[Onlooker] = (
            Robots(stream, chosen),
            Images(stream, chosen, calibrations),
            DepthMaps(stream, chosen, truth),
            Maps(stream, chosen, calibrations[Source.GROUND].camera),
            Localization(stream, truth),
            Curves(stream, chosen, truth),
            Messages(stream),
        )
        if truth is not None:
            self._parts = (*self._parts, TrueRobots(stream, chosen, truth, calibrations))

    def see(self, seen: Seen) -> None:
        """Draw one event."""
        for part in self._parts:
            part.see(seen)

    def close(self) -> None:
        """End the file."""
        self._stream.close()
