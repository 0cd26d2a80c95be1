"""All that is drawn of a run, from its events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from airground.core.cloud import Source
from airground.core.messages import RobotCalibration
from evaluation.run.onlooker import Onlooker, Seen
from evaluation.show.rerun_view.curves import Curves
from evaluation.show.rerun_view.depth_maps import DepthMaps
from evaluation.show.rerun_view.images import Images
from evaluation.show.rerun_view.layout import layout
from evaluation.show.rerun_view.localization import Localization
from evaluation.show.rerun_view.maps import Maps
from evaluation.show.rerun_view.messages import Messages
from evaluation.show.rerun_view.robots import Robots, TrueRobots
from evaluation.show.rerun_view.sensor_stream import LEVELS, LevelName, SensorStream
from sim.recording.truth import Truth

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
