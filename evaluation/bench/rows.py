"""The rows of the benchmark: a literal table. To add one, write its work and put a line here."""

from __future__ import annotations

from collections.abc import Sequence

from airground.errors import InputError
from evaluation.bench import dense_rows, localization_rows, map_rows, peers
from evaluation.bench.row import Peer, Row, of_table
from evaluation.setup.published import TimedStage

DENSE, GLOBAL = "Dense reconstruction", "Global localization"
REFINEMENT, INPUT = "Pose refinement", "Input"


def _ours(metric: str, title: str, group: str) -> TimedStage:
    """A stage that Table I does not time."""
    return TimedStage(metric, title, group, None, "", in_summary=False)


ROWS = (
    Row(
        of_table("ground_map"),
        map_rows.ground_map,
        None,
        (
            Peer(
                "Open3D",
                "open3d",
                "half a pixel off, beside jumps in depth too; no image is kept to fuse anew",
                peers.fuse_keyframe,
            ),
        ),
    ),
    Row(
        _ours("ground_surface", "Points of the ground map", "Egomotion"),
        map_rows.ground_surface,
        None,
        (
            Peer(
                "Open3D",
                "open3d",
                "in no lasting order, and without a surface that lies on voxels exactly",
                peers.extract_ground,
            ),
        ),
    ),
    Row(
        of_table("add_frame"),
        dense_rows.add_frame,
        9,
        (
            Peer(
                "OpenCV, plane by plane",
                "cv2",
                "samples the view halved, so blurred; no gain, no record of what is covered",
                peers.plane_by_plane,
            ),
        ),
    ),
    Row(of_table("depth_map"), dense_rows.depth_map),
    Row(
        of_table("distance_field"),
        dense_rows.distance_field,
        10,
        (
            Peer(
                "Open3D TSDF",
                "open3d",
                "a running mean near the surface only, no histogram",
                peers.integrate_one,
            ),
        ),
    ),
    Row(of_table("fusion"), dense_rows.fusion, 150),
    Row(of_table("ray_cast"), dense_rows.ray_cast, 10),
    Row(
        _ours("surface", "All of a surface from its depth maps", DENSE),
        dense_rows.surface,
        None,
        (
            Peer(
                "Open3D TSDF",
                "open3d",
                "a running mean, no regularization; every crossing, not only what the view sees",
                peers.integrate_and_extract,
            ),
        ),
    ),
    Row(of_table("height_map"), localization_rows.height_maps),
    Row(
        of_table("cost_map"),
        localization_rows.cost_map,
        6,
        (
            Peer(
                "scikit-image, masked",
                "skimage",
                "correlation instead of Eq. 2, over every offset with overlap, and its peak",
                peers.masked_correlation,
            ),
            Peer(
                "OpenCV, matchTemplate",
                "cv2",
                "correlation instead of Eq. 2; the ground map's holes count as its mean",
                peers.match_template,
            ),
        ),
    ),
    Row(
        _ours("cost_map_ncc", "Full cost map, by correlation", GLOBAL),
        localization_rows.cost_map_correlation,
        6,
    ),
    Row(
        _ours("headings", "Search over 360 headings", GLOBAL),
        localization_rows.heading_search,
        450,
    ),
    Row(of_table("particles"), localization_rows.particles, 3),
    Row(
        _ours("particles_heading", "200 particles with heading", GLOBAL),
        localization_rows.particles_heading,
        3,
    ),
    Row(
        of_table("icp"),
        map_rows.icp,
        200,
        (
            Peer(
                "Open3D ICP",
                "open3d",
                "no trimming, and one distance for all steps",
                peers.open3d_icp,
            ),
        ),
    ),
    Row(_ours("refinement", "Local search and ICP", REFINEMENT), map_rows.refinement),
    Row(of_table("augmentation"), map_rows.augmentation),
    Row(_ours("read_grey", "Read and decode, MAV", INPUT), map_rows.read_grey),
    Row(_ours("read_rgbd", "Read and decode, ground robot", INPUT), map_rows.read_colour_depth),
)

PLAYED = {
    "mono_slam": (of_table("mono_slam"), "mav", 8.0),
    "rgbd_slam": (of_table("rgbd_slam"), "ground", 8.0),
}
"""Rows that are timed while the whole recording is played: stage, robot, target [ms]."""
PIPELINE = "pipeline"
"""The row of the whole pipeline: its real-time factor."""
LIVE = "live"
"""The row of a live run: images dropped, and how late poses come."""
NAMES = (*PLAYED, PIPELINE, LIVE, *(row.name for row in ROWS))
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
