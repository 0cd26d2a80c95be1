"""`report.html`: one self-contained page to show a colleague, and the figures beside it."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from PIL import Image

from evaluation.judge.results import CONFIG, SHOWCASE, SUMMARY, TABLE, AtLevel, Results
from evaluation.judge.summary import Summary, build_summary
from evaluation.measure.showcase import Showcase
from evaluation.setup import published
from evaluation.setup.condition import RunInfo, shared_parts
from evaluation.setup.level_mark import LevelMark
from evaluation.setup.settings import write_config
from evaluation.show.figures.style import ReportFigure, save_figure, write_png
from evaluation.show.report.baselines import baseline_table
from evaluation.show.report.calibration import calibration_table, claims_table
from evaluation.show.report.error_budget import budget_table
from evaluation.show.report.failures import control_table, failures
from evaluation.show.report.figures import report_figures
from evaluation.show.report.files import beside, write_behind, write_latex
from evaluation.show.report.levels import level_figures, level_table
from evaluation.show.report.reproduction import reproduction_table
from evaluation.show.report.screen import live_table
from evaluation.show.report.seen import is_chart, seen
from evaluation.show.report.tables import comparison_table, headlines, scene_table, timing_table
from evaluation.show.report.trajectories import trajectory_table
from evaluation.table.limits import FOURTH_MAP, GOOD_POSE, LOCATED_M
from evaluation.table.rows import ResultTable


def write_results(results: Results, folder: Path) -> Summary:
    """Write table, summary, configuration, report and figures into an existing folder."""
    run = RunInfo.here(results.seed)
    summary = build_summary(results.table, results.table.conditions()[0], run, results.level)
    results.table.write(folder / TABLE)
    write_config(results.config, folder / CONFIG)
    if results.showcase is not None:
        results.showcase.save(folder / SHOWCASE)
    write_report(
        folder, results.table, results.showcase, run, results.notes, results.level, results.levels
    )
    summary.write(folder / SUMMARY)
    return summary


def write_report(
    out: Path,
    table: ResultTable,
    showcase: Showcase | None,
    run: RunInfo,
    notes: Sequence[str] = (),
    level: LevelMark | None = None,
    levels: Sequence[AtLevel] = (),
) -> None:
    """Write `report.html`, `figures/` (PNG, PDF, CSV) and `tables/` (LaTeX) into `out`.

    The primary condition, those of the other preset and then the rest are drawn side by side
    (four at most); all stand in the comparison.

    Args:
        out: Folder of the run; made where missing.
        table: Everything that was measured; its first condition is the primary one.
        showcase: What the pictures are drawn from; None leaves them out.
        run: Where the results come from.
        notes: Sentences that the page lists at its end.
        level: The level of difficulty that the page names; None without.
        levels: What was measured at each of several levels.
    """
    shown = table.conditions()
    primary = table.of(shown[0])
    measured = primary.scored()
    tables = {
        "reproduction": reproduction_table(table, shown),
        "by_level": level_table(levels),
        "comparison": comparison_table(table, shown),
        "trajectories": trajectory_table(table, shown),
        "budget": budget_table(measured),
        "baselines": baseline_table(primary),
        "claims": claims_table(primary),
        "calibration": calibration_table(measured),
        "timing": timing_table(measured),
        "live": live_table(measured),
        "by_scene": scene_table(measured),
        "controls": control_table(table, shown),
    }
    page = rendered(
        "report.html.j2",
        condition=shown[0].label(),
        scenes=measured.scenes(),
        run=run,
        level=level,
        headlines=headlines(measured),
        shared=shared_parts(shown) if len(shown) > 1 else shown[0].label(),
        pictures=[saved_picture(f, out, table) for f in report_figures(table, shown, showcase)],
        level_pictures=[saved_picture(drawn, out) for drawn in level_figures(levels)],
        files=write_latex(out, tables),
        beside=beside(out),
        failures=failures(measured),
        notes=list(notes),
        platform=published.PLATFORM,
        **tables,
    )
    (out / "report.html").write_text(page, encoding="utf-8")


PICTURE_WIDTH_PX = 1500
WEBP_QUALITY = 88


@dataclass(frozen=True)
class Picture:
    """A figure as a page embeds it.

    Attributes:
        name, title, caption, wide: Those of the figure.
        seen: What is seen, in words.
        chart: Whether its colours may be inverted.
        files: Names of its files, relative to the page.
        data_uri: The picture.
        width, height: Its size [px].
    """

    name: str
    title: str
    caption: str
    wide: bool
    seen: str
    chart: bool
    files: tuple[str, ...]
    data_uri: str
    width: int
    height: int


def saved_picture(drawn: ReportFigure, out: Path, table: ResultTable | None = None) -> Picture:
    """Save a figure into `figures/` of a folder, and pack it for the page; with the table, also the
    rows behind it."""
    save_figure(drawn.figure, out / "figures", drawn.name)
    behind = write_behind(out, drawn.name, table) if table is not None else ""
    with Image.open(out / "figures" / f"{drawn.name}.png") as opened:
        files = (f"figures/{drawn.name}.pdf", *([behind] if behind else []))
        return _embedded(drawn, opened, files)


def shown_picture(drawn: ReportFigure) -> Picture:
    """Pack a figure for a page that stands alone, without files beside it."""
    png = io.BytesIO()
    write_png(drawn.figure, png)
    with Image.open(png) as opened:
        return _embedded(drawn, opened, ())


def _embedded(drawn: ReportFigure, opened: Image.Image, files: tuple[str, ...]) -> Picture:
    image = opened.convert("RGB")
    if image.width > PICTURE_WIDTH_PX:
        height = round(image.height * PICTURE_WIDTH_PX / image.width)
        image = image.resize((PICTURE_WIDTH_PX, height), Image.Resampling.LANCZOS)
    return Picture(
        name=drawn.name,
        title=drawn.title,
        caption=drawn.caption,
        wide=drawn.wide,
        seen=seen(drawn.figure),
        chart=is_chart(drawn.figure),
        files=files,
        data_uri=webp_uri(image, WEBP_QUALITY),
        width=image.width,
        height=image.height,
    )


def webp_uri(image: Image.Image, quality: int) -> str:
    """An image as an address that holds it, compressed with loss."""
    packed = io.BytesIO()
    image.save(packed, "WEBP", quality=quality, method=4)
    return "data:image/webp;base64," + base64.b64encode(packed.getvalue()).decode("ascii")


def rendered(template: str, **words: object) -> str:
    """A template of this folder, filled; all text is escaped."""
    environment = Environment(
        loader=PackageLoader("evaluation.show", "report"),
        autoescape=select_autoescape(["html", "j2"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals.update(
        located=f"{LOCATED_M:g} m", judged_after=FOURTH_MAP, good_pose=GOOD_POSE
    )
    return environment.get_template(template).render(**words)
