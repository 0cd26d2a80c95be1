"""The whole picture of a run: its parts, and where the viewer shows them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import rerun.blueprint as rrb
from rerun.encodings import TimeRange, TimeRangeBoundary

from airground.config import Config
from airground.core.cloud import Source
from airground.core.messages import RobotCalibration
from evaluation.run.onlooker import Onlooker, Seen
from evaluation.show.rerun_view.images import ERROR_LIMIT_M, DepthMaps, Images
from evaluation.show.rerun_view.localization import TRUE_POSITION, Localization
from evaluation.show.rerun_view.maps import Maps
from evaluation.show.rerun_view.robots import SCENE, Robots, TrueRobots
from evaluation.show.rerun_view.sensor_stream import (
    COSTS,
    GROUND,
    LEVELS,
    TIMELINE,
    TRUTH,
    LevelName,
    SensorStream,
)
from evaluation.show.rerun_view.timeline import DECISIONS, ERRORS, Curves, Messages
from evaluation.show.rerun_view.verdicts import Verdicts
from sim.recording.truth import Truth

RUN_FILE = "run.rrd"
STAGE_MS = 250.0
"""Largest time that is shown at first: a stage's first call takes many times that."""
EYE_M, TARGET_M = (-2.9, -3.4, 4.3), (1.3, 0.7, 0.2)
"""Eye and target of the view in `ground` [m]: from behind the robot's start, along its path."""
LEFT_M, NEARER = 1.2, 0.75
"""How far both are moved to the left [m], and the eye towards the target, so that the way ahead
fills the panel."""
Times = tuple[int, int]
"""First and last stamp of a recording [ns]."""


class RunView:
    """An onlooker that writes a run to an .rrd file, and to a viewer that listens at an address.
    Without truth, errors and everything else under `/truth` are left out. Thresholds are those of
    `config`."""

    def __init__(
        self,
        path: Path,
        name: str,
        calibrations: Mapping[Source, RobotCalibration],
        truth: Truth | None,
        config: Config,
        times_ns: Times,
        level: LevelName = "stages",
        viewer: str | None = None,
    ) -> None:
        chosen = LEVELS[level]
        shown = layout(truth is not None, times_ns)
        self._stream = stream = SensorStream(path, name, shown, viewer)
        self._parts: list[Onlooker] = [
            Robots(stream, chosen),
            Images(stream, chosen, calibrations),
            DepthMaps(stream, chosen, truth),
            Maps(stream, chosen, calibrations[Source.GROUND].camera),
            Localization(stream, truth),
            Curves(stream, chosen, truth),
            Verdicts(stream, config, truth),
            Messages(stream),
        ]
        if truth is not None:
            self._parts.append(TrueRobots(stream, chosen, truth, calibrations))

    def see(self, seen: Seen) -> None:
        for part in self._parts:
            part.see(seen)

    def close(self) -> None:
        self._stream.close()


def layout(with_truth: bool, times_ns: Times, opens: str = TIMELINE) -> rrb.Blueprint:
    """The world on the left, the results of each stage on the right, curves below over all times.
    Without truth there is no panel for it. `opens` is the timeline on which it opens: that of the
    sensors plays, another waits at its beginning."""
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(
                rrb.Vertical(_world(with_truth), _messages(), row_shares=[5, 2]),
                _stages(with_truth),
                column_shares=[5, 4],
            ),
            _curves(with_truth, times_ns),
            row_shares=[7, 2],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(
            state="collapsed",
            timeline=opens,
            play_state="playing" if opens == TIMELINE else "paused",
        ),
        auto_layout=False,
        auto_views=False,
    )


def _world(with_truth: bool) -> rrb.Spatial3DView:
    """Both robots and their maps, in the ground robot's frame."""
    return rrb.Spatial3DView(
        origin="/",
        name="world: ground map red, MAV's map grey, newest surface orange"
        + (", truth pink" if with_truth else ""),
        contents=[
            "+ /ground/**",
            "+ /mav/**",
            f"+ {TRUTH}/**",
            "- /mav/depth_map",
            f"- {TRUTH}/depth_error",
            f"- {TRUE_POSITION}",
            f"- {ERRORS}/**",
        ],
        spatial_information=rrb.SpatialInformation(target_frame=GROUND),
        eye_controls=eye_from_behind(LEFT_M),
        line_grid=rrb.LineGrid3D(visible=False),
        overrides={SCENE: rrb.EntityBehavior(visible=False)},
    )


def eye_from_behind(left_m: float) -> rrb.EyeControls3D:
    """The eye behind the robot's start, moved to its left by so much [m]."""
    target = np.array(TARGET_M) + np.sqrt(0.5) * left_m * np.array([-1.0, 1.0, 0.0])
    eye = target + NEARER * np.subtract(EYE_M, TARGET_M)
    return rrb.EyeControls3D(position=eye, look_target=target, eye_up=(0, 0, 1))


def _stages(with_truth: bool) -> rrb.Vertical:
    depth = [_picture("/mav/depth_map", "depth map")]
    if with_truth:
        name = f"error: blue too near, red too far, ±{round(1e3 * ERROR_LIMIT_M)} mm"
        depth.append(_picture(f"{TRUTH}/depth_error", name))
    costs = rrb.Spatial2DView(
        origin="/localization/costs",
        contents=["+ $origin/**", f"+ {TRUE_POSITION}"],
        name="costs, particles",
        spatial_information=rrb.SpatialInformation(target_frame=COSTS),
    )
    return rrb.Vertical(
        rrb.Horizontal(
            _picture("/mav/camera/image", "MAV: image, corners", "$origin/**"),
            _picture("/ground/camera/image", "ground robot: image, corners", "$origin/**"),
        ),
        rrb.Horizontal(*depth),
        rrb.Horizontal(
            _picture("/localization/aerial_heights", "aerial heights"),
            _picture("/localization/ground_heights", "ground heights"),
            costs,
        ),
        row_shares=[4, 4, 5],
    )


def _picture(entity: str, name: str, contents: str = "$origin") -> rrb.Spatial2DView:
    return rrb.Spatial2DView(origin=entity, contents=contents, name=name)


def _messages() -> rrb.TextLogView:
    columns = rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["LogLevel", "Body"])
    return rrb.TextLogView(
        origin="/events",
        name="decisions: losses, refusals, claims",
        columns=columns,
        rows=rrb.TextLogRows(filter_by_log_level=[str(level) for level in DECISIONS]),
    )


def _curves(with_truth: bool, times_ns: Times) -> rrb.Horizontal:
    def plot(entity: str, name: str, largest: float | None = None) -> rrb.TimeSeriesView:
        return rrb.TimeSeriesView(
            origin=entity,
            name=name,
            plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop),
            axis_x=all_times(times_ns),
            axis_y=None if largest is None else rrb.ScalarAxis(range=(0.0, largest)),
        )

    errors = [
        plot(f"{ERRORS}/translation_m", "position error [m]"),
        plot(f"{ERRORS}/rotation_deg", "angular error [deg]"),
    ]
    return rrb.Horizontal(
        *(errors if with_truth else []),
        rrb.Tabs(
            plot("/curves/spread_m", "spread [m]"),
            plot("/curves/overlap", "overlap"),
            plot("/curves/inliers", "inliers"),
        ),
        rrb.Tabs(
            plot("/curves/corners", "corners in the map"),
            plot("/curves/sigma_mm", "sigma of the position [mm]"),
        ),
        plot("/curves/stage_ms", "stage times [ms]", STAGE_MS),
        column_shares=[*([4, 4] if with_truth else []), 3, 4, 5],
    )


def all_times(times_ns: Times) -> rrb.TimeAxis:
    """One range for all plots, so that the cursor stands at the same place in each."""
    first, last = (TimeRangeBoundary.absolute(seconds=time_ns / 1e9) for time_ns in times_ns)
    return rrb.TimeAxis(view_range=TimeRange(start=first, end=last))
