"""The rows of the benchmark: a literal table. To add one, write its work and put a line here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from airground.errors import InputError
from evaluation.bench import dense_rows, localization_rows, simulation_rows
from evaluation.bench.material import Material
from evaluation.bench.peers import PEERS, Peer
from evaluation.bench.recording_speed import RECORDED
from evaluation.bench.work import Work
from evaluation.setup.published import TABLE_I, TimedStage


@dataclass(frozen=True)
class Row:
    """One line of the table; `target_ms` is the median aimed at on two idle cores, if any."""

    stage: TimedStage
    make: Callable[[Material], Work]
    target_ms: float | None = None

    @property
    def name(self) -> str:
        return self.stage.metric

    @property
    def peers(self) -> tuple[Peer, ...]:
        """The same work by other libraries."""
        return PEERS.get(self.name, ())


class Contender(NamedTuple):
    """A row's own work, or that of one of its peers."""

    row: str
    peer: str | None = None


STAGES = {stage.metric: stage for stage in TABLE_I}
EGOMOTION, DENSE, GLOBAL = "Egomotion", "Dense reconstruction", "Global localization"
REFINEMENT, INPUT, SIMULATION = "Pose refinement", "Input", "Simulation"


def _ours(metric: str, title: str, group: str) -> TimedStage:
    """A stage that Table I does not time."""
    return TimedStage(metric, title, group, None, "")


ROWS = (
    Row(STAGES["ground_map"], dense_rows.ground_map),
    Row(_ours("ground_surface", "Points of the ground map", EGOMOTION), dense_rows.ground_surface),
    Row(STAGES["add_frame"], dense_rows.add_frame, 9),
    Row(STAGES["depth_map"], dense_rows.depth_map),
    Row(STAGES["distance_field"], dense_rows.distance_field, 10),
    Row(STAGES["fusion"], dense_rows.fusion, 150),
    Row(STAGES["ray_cast"], dense_rows.ray_cast, 10),
    Row(_ours("surface", "All of a surface from its depth maps", DENSE), dense_rows.surface),
    Row(STAGES["height_map"], localization_rows.height_maps),
    Row(STAGES["cost_map"], localization_rows.cost_map, 6),
    Row(
        _ours("cost_map_ncc", "Full cost map, by correlation", GLOBAL),
        localization_rows.cost_map_correlation,
        6,
    ),
    Row(
        _ours("cost_map_channels", "Full cost map, by channels", GLOBAL),
        localization_rows.cost_map_channels,
    ),
    Row(
        _ours("headings", "Search over 360 headings", GLOBAL), localization_rows.heading_search, 450
    ),
    Row(
        _ours("headings_channels", "Search over 360 headings, by channels", GLOBAL),
        localization_rows.heading_search_channels,
    ),
    Row(STAGES["particles"], localization_rows.particles, 3),
    Row(
        _ours("particles_heading", "200 particles with heading", GLOBAL),
        localization_rows.particles_heading,
        3,
    ),
    Row(
        _ours("particles_channels", "200 particles with heading, by channels", GLOBAL),
        localization_rows.particles_channels,
    ),
    Row(STAGES["icp"], localization_rows.icp, 200),
    Row(_ours("refinement", "Local search and ICP", REFINEMENT), localization_rows.refinement),
    Row(STAGES["augmentation"], localization_rows.augmentation),
    Row(_ours("read_grey", "Read and decode, MAV", INPUT), dense_rows.read_grey),
    Row(_ours("read_rgbd", "Read and decode, ground robot", INPUT), dense_rows.read_colour_depth),
    Row(
        _ours("sim_draw_grey", "Draw an image, MAV", SIMULATION),
        partial(simulation_rows.draw, "mav"),
    ),
    Row(
        _ours("sim_draw_rgbd", "Draw an image, ground robot", SIMULATION),
        partial(simulation_rows.draw, "ground"),
    ),
    Row(
        _ours("sim_exposure_grey", "Exposure, MAV", SIMULATION),
        partial(simulation_rows.expose, "mav"),
    ),
    Row(
        _ours("sim_exposure_rgbd", "Exposure, ground robot", SIMULATION),
        partial(simulation_rows.expose, "ground"),
    ),
    Row(_ours("sim_depth_noise", "Depth noise", SIMULATION), simulation_rows.depth_noise),
    Row(_ours("sim_png_grey", "Encode, MAV", SIMULATION), simulation_rows.encode_grey),
    Row(_ours("sim_png_rgbd", "Encode, ground robot", SIMULATION), simulation_rows.encode_rgbd),
)

PLAYED = {
    "mono_slam": (STAGES["mono_slam"], "mav", 8.0),
    "rgbd_slam": (STAGES["rgbd_slam"], "ground", 8.0),
}
"""Rows that are timed while the whole recording is played: stage, robot, target [ms]."""
PIPELINE = "pipeline"
"""The row of the whole pipeline: its real-time factor."""
LIVE = "live"
"""The row of a live run: images dropped, and delays of the poses."""
NAMES = (*PLAYED, PIPELINE, LIVE, *RECORDED, *(row.name for row in ROWS))
BY_NAME = {row.name: row for row in ROWS}


def checked_names(names: Sequence[str]) -> tuple[str, ...]:
    """The names in the table's order; all of them where none is given.

    Raises:
        InputError: There is no row of that name.
    """
    unknown = [name for name in names if name not in NAMES]
    if unknown:
        raise InputError(f"--rows {','.join(unknown)}: unknown; known: {', '.join(NAMES)}")
    return tuple(name for name in NAMES if not names or name in names)
