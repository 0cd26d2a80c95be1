"""The whole picture of a run: its parts, and where the viewer shows them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import rerun.blueprint as rrb

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
from evaluation.show.rerun_view.timeline import ERRORS, Curves, Messages
from sim.recording.truth import Truth

RUN_FILE = "run.rrd"
EYE_M, TARGET_M = (-2.9, -3.4, 4.3), (1.3, 0.7, 0.2)
"""Eye and target of the view in `ground` [m]: from behind the robot's start, along its path."""


class RunView:
    """An onlooker that writes a run to an .rrd file, and to a viewer that listens at an address.
    Without truth, errors and everything else under `/truth` are left out."""

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
        self._parts: list[Onlooker] = [
            Robots(stream, chosen),
            Images(stream, chosen, calibrations),
            DepthMaps(stream, chosen, truth),
            Maps(stream, chosen, calibrations[Source.GROUND].camera),
            Localization(stream, truth),
            Curves(stream, chosen, truth),
            Messages(stream),
        ]
        if truth is not None:
            self._parts.append(TrueRobots(stream, chosen, truth, calibrations))

    def see(self, seen: Seen) -> None:
        for part in self._parts:
            part.see(seen)

    def close(self) -> None:
        self._stream.close()


def layout(with_truth: bool) -> rrb.Blueprint:
    """The world on the left, the results of each stage on the right, curves below.
    Without truth there is no panel for it."""
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(
                rrb.Vertical(_world(with_truth), _messages(), row_shares=[9, 2]),
                _stages(with_truth),
                column_shares=[5, 4],
            ),
            _curves(with_truth),
            row_shares=[7, 2],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="playing"),
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
        eye_controls=rrb.EyeControls3D(position=EYE_M, look_target=TARGET_M, eye_up=(0, 0, 1)),
        line_grid=rrb.LineGrid3D(visible=False),
        overrides={SCENE: rrb.EntityBehavior(visible=False)},
    )


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
    return rrb.TextLogView(origin="/events", name="events", columns=columns)


def _curves(with_truth: bool) -> rrb.Horizontal:
    errors = [
        _plot(f"{ERRORS}/translation_m", "position error [m]"),
        _plot(f"{ERRORS}/rotation_deg", "angular error [deg]"),
    ]
    return rrb.Horizontal(
        *(errors if with_truth else []),
        _plot("/curves/spread_m", "spread [m]"),
        rrb.Tabs(
            _plot("/curves/corners", "corners in the map"),
            _plot("/curves/sigma_mm", "sigma of the position [mm]"),
        ),
        _plot("/curves/stage_ms", "stage times [ms]"),
        column_shares=[*([4, 4] if with_truth else []), 3, 4, 5],
    )


def _plot(entity: str, name: str) -> rrb.TimeSeriesView:
    legend = rrb.PlotLegend(corner=rrb.Corner2D.LeftTop)
    return rrb.TimeSeriesView(origin=entity, name=name, plot_legend=legend)
