"""A pair of recordings made of one real RGB-D sequence: even frames for the ground robot, odd ones
for the MAV.

The sequence is the sample of 7-Scenes in andyzeng/tsdf-fusion-python, read from a mirror of that
repository beside the checkout. Nothing of it is part of the project.

    PYTHONPATH=. python -m tests.real_pair OUT
"""

from __future__ import annotations

import io
import subprocess
import sys
import tarfile
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3, nearest_rotation
from airground.core.trajectory import Trajectory
from airground.io.tum import format_stamp, read_tum, write_tum
from evaluation import cli

MIRROR = Path(__file__).parents[2] / ".mirror" / "andyzeng+tsdf-fusion-python" / "repo"
COMMIT = "3f22a940"
FRAMES = 500
"""Frames from 500 on are kept for judging."""
RATE_HZ = 30
DEPTH_FOCAL_PX, DEPTH_CENTRE = 585.0, (320.0, 240.0)
"""The depth camera, as published."""
COLOUR_FOCAL_PX, COLOUR_CENTRE = 526.6, (323.5, 235.0)
SHIFT_M = (-0.034, 0.008)
"""The colour camera, and its shift from the depth camera: where edges of depth lie on edges of
colour, in 30 of the frames."""
T_MAV_GROUND = SE3.from_heading(np.deg2rad(50.0), (1.0, 2.0, 0.3))
"""Place of the ground robot's frame in the MAV's: the poses do not tell where the MAV is."""
SETTINGS = (
    "view_selection.depth_map_radius_m=0.2",
    "view_selection.max_views=12",
    "view_selection.depth_map_spacing_m=0.06",
    "view_selection.fusion_radius_m=0.4",
    "refinement.local_search_radius_m=0.2",
)
"""Parameters for a hand-held camera that looks across a table: wider views, shorter surfaces."""


def make_pair(out: Path) -> Path:
    """Write `mav/`, `ground/`, `mav.tum` and `ground.tum`.

    Depth is registered to colour. Poses of both are those of our RGB-D SLAM over all of these
    frames: the published ones are 0.6 px off the colour images.
    """
    source = out / "source"
    _unpack(source)
    stamps = [round(1e9 * number / RATE_HZ) for number in range(FRAMES)]
    write_folder(out / "all", stamps, [_registered(source, n) for n in range(FRAMES)])
    assert airground("track", out / "all", "--out", out / "tracked") == 0
    poses = _levelled(out / "tracked" / "trajectory.tum", source)
    for name, start in (("ground", 0), ("mav", 1)):
        chosen = slice(start, None, 2)
        pairs = [_registered(source, n) for n in range(FRAMES)[chosen]]
        write_folder(out / name, stamps[chosen], pairs)
        own = SE3.identity() if name == "ground" else T_MAV_GROUND
        posed = [(t, own @ poses.at(t)) for t in stamps[chosen]]
        write_tum(out / f"{name}.tum", Trajectory.from_poses(*map(list, zip(*posed, strict=True))))
    return out


def run_pair_of(made: Path, out: Path) -> int:
    """Run the pipeline over a made pair; the exit code."""
    words: list[object] = ["run", "--mav", made / "mav", "--ground", made / "ground"]
    words += ["--mav-trajectory", made / "mav.tum", "--ground-trajectory", made / "ground.tum"]
    words += ["--heading", "search", "--out", out]
    return airground(*words, *(word for one in SETTINGS for word in ("--set", one)))


def airground(*words: object) -> int:
    """The exit code of the command."""
    try:
        cli.main([str(word) for word in words])
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


def write_folder(
    folder: Path, stamps: list[int], images: list[tuple[Path, NDArray[np.uint16]]]
) -> None:
    """A TUM folder of colour files and registered depth [mm], with its calibration."""
    for kind in ("rgb", "depth"):
        (folder / kind).mkdir(parents=True)
    lines = []
    for stamp, (colour, depth) in zip(stamps, images, strict=True):
        time = format_stamp(stamp)
        (folder / "rgb" / f"{time}.jpg").write_bytes(colour.read_bytes())
        cv2.imwrite(str(folder / "depth" / f"{time}.png"), depth)
        lines.append(f"{time} rgb/{time}.jpg {time} depth/{time}.png")
    (folder / "associations.txt").write_text("\n".join(lines) + "\n")
    (folder / "calibration.yaml").write_text(
        "resolution: [640, 480]\n"
        f"intrinsics: [{COLOUR_FOCAL_PX}, {COLOUR_FOCAL_PX}, {COLOUR_CENTRE[0]}, "
        f"{COLOUR_CENTRE[1]}]\ndistortion_model: none\ndepth_units_per_m: 1000\n"
    )


def _unpack(into: Path) -> None:
    """Frames of the mirror, without a work tree."""
    kinds = ("color.jpg", "depth.png", "pose.txt")
    names = [f"data/frame-{n:06d}.{kind}" for n in range(FRAMES) for kind in kinds]
    words = ["git", f"--git-dir={MIRROR}", "archive", COMMIT, "data/gravity-direction.txt"]
    packed = subprocess.run([*words, *names], check=True, capture_output=True).stdout
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        archive.extractall(into, filter="data")


def _registered(source: Path, number: int) -> tuple[Path, NDArray[np.uint16]]:
    """A colour file, and the nearest depth [mm] at each of its pixels; 0 is missing."""
    stem = source / "data" / f"frame-{number:06d}"
    raw = cv2.imread(f"{stem}.depth.png", cv2.IMREAD_UNCHANGED)
    assert raw is not None
    y, x = np.nonzero((raw > 0) & (raw < 65535))
    z = raw[y, x] / 1000.0
    points = np.column_stack(
        [
            (x - DEPTH_CENTRE[0]) / DEPTH_FOCAL_PX + SHIFT_M[0] / z,
            (y - DEPTH_CENTRE[1]) / DEPTH_FOCAL_PX + SHIFT_M[1] / z,
        ]
    )
    u, v = np.rint(COLOUR_FOCAL_PX * points + COLOUR_CENTRE).astype(int).T
    inside = (u >= 0) & (v >= 0) & (u < raw.shape[1]) & (v < raw.shape[0])
    depth = np.full(raw.shape, np.iinfo(np.uint16).max, np.uint16)
    np.minimum.at(depth, (v[inside], u[inside]), raw[y, x][inside])
    depth[depth == np.iinfo(np.uint16).max] = 0
    return stem.with_suffix(".color.jpg"), depth


def _levelled(trajectory: Path, source: Path) -> Trajectory:
    """Tracked poses with z up, by the published gravity and the published pose of the first."""

    tracked = read_tum(trajectory)
    published = np.loadtxt(source / "data" / "frame-000000.pose.txt")
    up = -np.loadtxt(source / "data" / "gravity-direction.txt").ravel()
    up /= np.linalg.norm(up)
    x = np.cross((0.0, 0.0, 1.0), up)
    x /= np.linalg.norm(x)
    level = SE3(nearest_rotation(np.array([x, np.cross(up, x), up])), np.zeros(3))
    T_world_camera = SE3(nearest_rotation(published[:3, :3]), published[:3, 3])
    T_level_map = level @ T_world_camera @ tracked[0].inverse()
    poses = [T_level_map @ tracked[index] for index in range(len(tracked))]
    return Trajectory.from_poses(tracked.stamps_ns.tolist(), poses)


if __name__ == "__main__":
    folder = make_pair(Path(sys.argv[1]))
    sys.exit(run_pair_of(folder, folder / "out"))
