"""What the viewer shows where, made for this task and kept in the file."""

from __future__ import annotations

import rerun.blueprint as rrb

from evaluation.show.rerun_view.curves import ERRORS
from evaluation.show.rerun_view.depth_maps import ERROR_LIMIT_M
from evaluation.show.rerun_view.localization import TRUE_POSITION
from evaluation.show.rerun_view.robots import SCENE
from evaluation.show.rerun_view.sensor_stream import COSTS, GROUND, TIMELINE, TRUTH

EYE_M, TARGET_M = (-2.9, -3.4, 4.3), (1.3, 0.7, 0.2)
"""Of the view, in the ground robot's map: from behind its start, over its way."""


def layout(with_truth: bool) -> rrb.Blueprint:
    """The world on the left, what each stage makes on the right, curves below.

    Without truth no panel waits for it.
    """
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
    error_mm = round(1e3 * ERROR_LIMIT_M)
    depth = [_picture("/mav/depth_map", "depth map")]
    if with_truth:
        name = f"its error: blue near, red far, ±{error_mm} mm"
        depth.append(_picture(f"{TRUTH}/depth_error", name))
    return rrb.Vertical(
        rrb.Horizontal(
            _image("/mav/camera/image", "MAV: image, corners"),
            _image("/ground/camera/image", "ground robot: image, corners"),
        ),
        rrb.Horizontal(*depth),
        rrb.Horizontal(
            _picture("/localization/aerial_heights", "aerial heights"),
            _picture("/localization/ground_heights", "ground heights"),
            rrb.Spatial2DView(
                origin="/localization/costs",
                contents=["+ $origin/**", f"+ {TRUE_POSITION}"],
                name="costs, particles",
                spatial_information=rrb.SpatialInformation(target_frame=COSTS),
            ),
        ),
        row_shares=[4, 4, 5],
    )


def _image(entity: str, name: str) -> rrb.Spatial2DView:
    return rrb.Spatial2DView(origin=entity, contents="$origin/**", name=name)


def _picture(entity: str, name: str) -> rrb.Spatial2DView:
    return rrb.Spatial2DView(origin=entity, contents="$origin", name=name)


def _messages() -> rrb.TextLogView:
    columns = rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["LogLevel", "Body"])
    return rrb.TextLogView(origin="/events", name="what happened", columns=columns)


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
    return rrb.TimeSeriesView(
        origin=entity,
        name=name,
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop),
    )
