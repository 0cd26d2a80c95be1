"""Where the viewer shows two runs: one world, the pictures side by side, the curves in one plot."""

from __future__ import annotations

import rerun.blueprint as rrb

from evaluation.judge.divergence import Held
from evaluation.show.rerun_view.differences import conclusion
from evaluation.show.rerun_view.images import ERROR_LIMIT_M
from evaluation.show.rerun_view.localization import TRUE_POSITION
from evaluation.show.rerun_view.run_view import eye_from_behind
from evaluation.show.rerun_view.sensor_stream import COSTS, GROUND, TIMELINE, TRUTH
from evaluation.show.rerun_view.timeline import ERRORS
from evaluation.show.rerun_view.trace import RunFile

Colour = tuple[int, int, int]
SECOND = "/second"
"""Root of the second run's entities."""
SECOND_FRAME = "second_"
"""Before the name of each of the second run's frames."""
DIFFERENCES, MARKERS = "/differences", "/differences/curves"
"""Messages at the first differences, and points in the plots at the earliest."""
FROM_DIFFERENCE = "from_first_difference"
"""A timeline with the stamps of `sensor_time` that begins at the earliest difference."""
LEFT_M = 0.5
"""How far the eye moves to the left [m]: the panel is narrower than that of one run."""


def two_runs_layout(first: RunFile, second: RunFile, earliest: Held | None) -> rrb.Blueprint:
    """The world with the events on the left, both runs' pictures in two columns on the right,
    curves of both below. It opens at the earliest difference."""
    runs = ((first, "", "blue"), (second, SECOND, "orange"))
    return rrb.Blueprint(
        rrb.Vertical(
            rrb.Horizontal(
                rrb.Vertical(_world(first, second), _messages(earliest), row_shares=[5, 3]),
                *(_pictures(run, root, colour) for run, root, colour in runs),
                column_shares=[5, 2, 2],
            ),
            _curves(first.has_truth),
            row_shares=[7, 3],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        _time_panel(earliest),
        auto_layout=False,
        auto_views=False,
    )


def _time_panel(earliest: Held | None) -> rrb.TimePanel:
    timeline = TIMELINE if earliest is None else FROM_DIFFERENCE
    return rrb.TimePanel(state="collapsed", timeline=timeline, play_state="paused")


def _world(first: RunFile, second: RunFile) -> rrb.Spatial3DView:
    """Both runs in the first ground robot's frame; the second's ground map waits behind its eye in
    the list of entities, since it lies on the first's."""
    shown = [f"+ {root}/{robot}/**" for root in ("", SECOND) for robot in ("ground", "mav")]
    hidden = [f"- {root}/mav/depth_map" for root in ("", SECOND)]
    true = [f"+ {TRUTH}/**", f"- {TRUTH}/depth_error", f"- {TRUE_POSITION}", f"- {ERRORS}/**"]
    names = f"{first.name} blue, {second.name} orange"
    return rrb.Spatial3DView(
        origin="/",
        name=f"world: {names}" + (", truth pink" if first.has_truth else ""),
        contents=[*shown, *hidden, *true],
        spatial_information=rrb.SpatialInformation(target_frame=GROUND),
        eye_controls=eye_from_behind(LEFT_M),
        line_grid=rrb.LineGrid3D(visible=False),
        overrides={
            entity: rrb.EntityBehavior(visible=False)
            for entity in (f"{TRUTH}/scene", f"{SECOND}/ground/map")
        },
    )


def _pictures(run: RunFile, root: str, colour: str) -> rrb.Vertical:
    """The stages of one run from the image down to the particles."""
    depth = [_picture(f"{root}/mav/depth_map", "depth map")]
    if run.has_truth:
        name = f"depth error, ±{round(1e3 * ERROR_LIMIT_M)} mm"
        depth.append(_picture(f"{root}{TRUTH}/depth_error", name))
    frame = f"{SECOND_FRAME}{COSTS}" if root else COSTS
    costs = rrb.Spatial2DView(
        origin=f"{root}/localization/costs",
        contents=["+ $origin/**", f"+ {root}{TRUE_POSITION}"],
        name="costs, particles",
        spatial_information=rrb.SpatialInformation(target_frame=frame),
    )
    return rrb.Vertical(
        _picture(f"{root}/mav/camera/image", f"{run.name} ({colour}): MAV", "$origin/**"),
        rrb.Tabs(*reversed(depth)),
        rrb.Tabs(
            costs,
            _picture(f"{root}/localization/aerial_heights", "aerial heights"),
            _picture(f"{root}/ground/camera/image", "ground robot", "$origin/**"),
        ),
        row_shares=[1, 1, 1],
    )


def _picture(entity: str, name: str, contents: str = "$origin") -> rrb.Spatial2DView:
    return rrb.Spatial2DView(origin=entity, contents=contents, name=name)


def _messages(earliest: Held | None) -> rrb.TextLogView:
    columns = rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["LogLevel", "Body"])
    contents = [f"+ {DIFFERENCES}", "+ /events", f"+ {SECOND}/events"]
    return rrb.TextLogView(
        origin="/", contents=contents, name=f"events: {conclusion(earliest)}", columns=columns
    )


def _curves(with_truth: bool) -> rrb.Horizontal:
    errors = [
        _plot(f"{ERRORS}/translation_m", "position error [m]"),
        _plot(f"{ERRORS}/rotation_deg", "angular error [deg]"),
    ]
    return rrb.Horizontal(
        *(errors if with_truth else []),
        rrb.Tabs(
            _plot("/curves/spread_m", "spread [m]"),
            _plot("/curves/corners", "corners in the map"),
            _plot("/curves/sigma_mm", "sigma of the position [mm]"),
        ),
    )


def _plot(entity: str, name: str) -> rrb.TimeSeriesView:
    """The curves of both runs, and the point at the first difference."""
    return rrb.TimeSeriesView(
        origin="/",
        contents=[f"+ {entity}/**", f"+ {SECOND}{entity}/**", f"+ {MARKERS}"],
        name=name,
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
    )
