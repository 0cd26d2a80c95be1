"""One self-contained page of a dataset: what it shows, how it moves, what an inspection found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from airground.core.cloud import Source
from airground.errors import AirgroundError, RecordingError
from airground.io.open_recording import layout_of, open_robot
from airground.io.recording_folder import RecordingFolder
from airground.io.robot_recording import Pair
from evaluation.datasets.gallery.figures import NAMES, from_above, statistics
from evaluation.datasets.gallery.overlap import shared_with_ground
from evaluation.datasets.gallery.statistics import Recorded, Sample, look_at
from evaluation.datasets.inspection.findings import Finding, Verdict
from evaluation.datasets.inspection.inspect_dataset import Opener, recordings_in
from evaluation.setup.progress import step
from evaluation.setup.text import MISSING, TextTable, formatted
from evaluation.show.report.page import Picture, rendered, shown_picture, webp_uri
from sim.recording.truth import Truth

THUMBNAIL_PX, QUALITY = 300, 72
"""Width and WebP quality of the images on a contact sheet: about 10 kB each."""
SHEET = 6
"""Images of a robot on a contact sheet."""
DEPTH_M = (0.5, 5.0)
"""Range of depth in colours [m]."""
ROLES = {
    "airground": (Source.MAV, Source.GROUND),
    "euroc": (Source.MAV,),
    "tum": (Source.GROUND,),
    "7scenes": (Source.GROUND,),
    "ros": (Source.MAV, Source.GROUND),
}
SURFACE_POINTS = 400_000
"""Points that are drawn on the true surface: 40 in each cell of 5 cm on 25 square metres."""


@dataclass(frozen=True)
class Thumbnail:
    """An image on a contact sheet."""

    caption: str
    data_uri: str
    width: int
    height: int


@dataclass(frozen=True, eq=False)
class Section:
    """One recording on the page.

    Attributes:
        name: Name of the recording.
        facts: What it is, in a line.
        robots: What each robot recorded, without the images.
        sheet: Rows of images, one per robot, and one of depth where there is some.
        above: The paths from above; None without truth.
        shared: (K,) shares of MAV images that the ground robot sees, too; empty without truth.
        megabytes: Size of its files.
    """

    name: str
    facts: str
    robots: tuple[Recorded, ...]
    sheet: tuple[tuple[Thumbnail, ...], ...]
    above: Picture | None
    shared: NDArray[np.float64]
    megabytes: float


def dataset_page(dataset: Path, opener: Opener, findings: Sequence[Finding]) -> str:
    """The page of a recording, or of all in a folder, with what an inspection has found.

    Raises:
        InputError: No recording can be read.
    """
    found = recordings_in(dataset)
    sections = []
    with step("drawing", len(found), "recordings") as drawing:
        for name, folder in found.items():
            section = _section(name, folder, opener)
            sections += [section] if section.robots else []
            drawing.advance()
    if not sections:
        raise RecordingError(
            f"{dataset}: no recording in it can be read; see inspect without --page"
        )
    robots = [one for section in sections for one in section.robots]
    pictures = [shown_picture(one) for one in statistics(robots, [one.shared for one in sections])]
    noted = [one for one in findings if one.verdict is not Verdict.FINE]
    rows = tuple((one.part or "all", str(one.verdict), one.subject, one.found) for one in noted)
    return rendered(
        "dataset.html.j2",
        name=dataset.resolve().name,
        sections=sections,
        seconds=sum(max(one.duration_s for one in section.robots) for section in sections),
        images=sum(one.images for one in robots),
        megabytes=sum(section.megabytes for section in sections),
        wrong=sum(one.verdict is Verdict.WRONG for one in findings),
        looked=len(findings),
        table=statistics_table(sections),
        pictures=pictures,
        noted=TextTable(("part", "verdict", "what", "found"), rows),
    )


def statistics_table(sections: Sequence[Section]) -> TextTable:
    """One row per robot and recording: medians, with the 95th percentile of the motion."""
    header = (
        "recording", "images", "path", "speed, 95 %", "turning, 95 %", "overlap after 1 s",
        "shared with ground", "mean grey", "dark, white",
    )  # fmt: skip
    rows = []
    for section in sections:
        for one in section.robots:
            shared = section.shared if one.robot == "mav" else np.zeros(0)
            rows.append(
                (
                    f"{section.name} {NAMES[one.robot]}",
                    f"{one.images}\n{one.duration_s:.1f} s",
                    formatted(one.path_m, "{:.1f} m"),
                    _spread(one.speed_m_s, "m/s"),
                    _spread(one.turn_deg_s, "deg/s"),
                    _median(100 * one.overlap, "{:.0f} %"),
                    _median(100 * shared, "{:.0f} %"),
                    _median(one.mean_grey, "{:.0f}"),
                    f"{100 * one.dark.mean():.1f}, {100 * one.white.mean():.1f} %",
                )
            )
    return TextTable(header, tuple(rows))


def _spread(values: NDArray[np.float64], unit: str) -> str:
    if not len(values):
        return MISSING
    return f"{np.median(values):.2g} {unit}\n{np.percentile(values, 95):.2g} {unit}"


def _median(values: NDArray[np.float64], form: str) -> str:
    known = values[np.isfinite(values)]
    return form.format(np.median(known)) if len(known) else MISSING


def _section(name: str, folder: Path, opener: Opener) -> Section:
    """What can be read of a recording: a robot that cannot be opened is a finding, and left out."""
    layout = layout_of(folder)
    assert layout is not None
    robots = []
    for role in ROLES[layout]:
        try:
            robots.append(
                look_at(opener(folder, role) if layout != "airground" else open_robot(folder, role))
            )
        except AirgroundError:
            continue
    facts, shared, surface = f"{layout} layout", np.zeros(0), None
    if layout == "airground" and robots:
        recording = RecordingFolder.open(folder)
        facts = recording.header.facts()
        if robots[0].path_world is not None:
            truth, there = Truth.open(folder), recording.header.frames.robots()
            if len(there) > 1:
                pair = Pair(recording.of(Source.MAV), recording.of(Source.GROUND))
                shared = shared_with_ground(pair, truth)
            drawn = truth.surface(there[-1]).mesh.sample_points_uniformly(SURFACE_POINTS)
            surface = np.asarray(drawn.points)
    figure = from_above(name, robots, surface)
    return Section(
        name=name,
        facts=facts,
        robots=tuple(replace(one, samples=()) for one in robots),
        sheet=tuple(row for one in robots for row in _rows(one)),
        above=None if figure is None else shown_picture(figure),
        shared=shared,
        megabytes=sum(file.stat().st_size for file in _files(folder)) / 1e6,
    )


def _files(path: Path) -> list[Path]:
    return [path] if path.is_file() else [one for one in path.rglob("*") if one.is_file()]


def _rows(recorded: Recorded) -> list[tuple[Thumbnail, ...]]:
    """Every other image that was read, and their depth."""
    last = len(recorded.samples) - 1
    chosen = [recorded.samples[i] for i in np.unique(np.linspace(0, last, SHEET).astype(int))]
    who = NAMES[recorded.robot]
    rows = [tuple(_thumbnail(f"{who}, {one.time_s:.1f} s", one.pixels) for one in chosen)]
    with_depth = [one for one in chosen if one.depth is not None]
    if with_depth:
        rows.append(
            tuple(_thumbnail(f"depth, {one.time_s:.1f} s", _coloured(one)) for one in with_depth)
        )
    return rows


def _thumbnail(caption: str, pixels: NDArray[np.uint8]) -> Thumbnail:
    image = Image.fromarray(pixels)
    image.thumbnail((THUMBNAIL_PX, THUMBNAIL_PX), Image.Resampling.LANCZOS)
    return Thumbnail(caption, webp_uri(image, QUALITY), image.width, image.height)


def _coloured(sample: Sample) -> NDArray[np.uint8]:
    """Depth in colours, near is bright; what is missing is black."""
    assert sample.depth is not None
    near, far = DEPTH_M
    grey = np.clip((far - sample.depth) / (far - near), 0, 1)
    levels = np.rint(255 * np.nan_to_num(grey)).astype(np.uint8)
    coloured = cv2.applyColorMap(levels, cv2.COLORMAP_VIRIDIS)[..., ::-1].copy()
    coloured[np.isnan(sample.depth)] = 0
    return np.asarray(coloured, np.uint8)
