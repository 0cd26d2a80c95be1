"""`report.html`: one self-contained page to show a colleague, and the figures beside it."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined, Template, select_autoescape
from PIL import Image

from evaluation.figures.style import save_figure
from evaluation.report import published
from evaluation.report.baselines import baseline_table
from evaluation.report.budget import budget_table
from evaluation.report.calibration import calibration_table, claims_table
from evaluation.report.failures import control_table, failure_table
from evaluation.report.figures import report_figures
from evaluation.report.headline import headlines
from evaluation.report.live import live_table
from evaluation.report.tables import comparison_table, scene_table, timing_table
from evaluation.report.trajectories import trajectory_table
from evaluation.results.run_info import RunInfo
from evaluation.results.table import Condition, ResultTable, shared_parts
from evaluation.showcase.figures import ReportFigure
from evaluation.showcase.showcase import Showcase

PICTURE_WIDTH_PX = 1500
WEBP_QUALITY = 88


@dataclass(frozen=True)
class Picture:
    """A figure as the page embeds it."""

    name: str
    title: str
    caption: str
    wide: bool
    data_uri: str
    width: int
    height: int


def write_report(
    out: Path,
    table: ResultTable,
    showcase: Showcase | None,
    run: RunInfo,
    conditions: Sequence[Condition] | None = None,
    notes: Sequence[str] = (),
) -> None:
    """Write `report.html` and `figures/` (PNG and PDF) into `out`.

    Args:
        out: Folder of the run; made where missing.
        table: Everything that was measured.
        showcase: What the pictures are drawn from; None leaves them out.
        run: Where the results come from.
        conditions: What to show, the primary one first; None shows all of the table. The
            primary one, those of the other preset and then the rest are drawn side by side
            (four at most); all stand in the comparison.
        notes: Sentences for "What to know": what missed its mark and why.
    """
    shown = list(conditions) if conditions is not None else table.conditions()
    primary = table.of(shown[0])
    measured = primary.without_controls()
    pictures = []
    for drawn in report_figures(table, shown, showcase):
        save_figure(drawn.figure, out / "figures", drawn.name)
        pictures.append(_embedded(drawn, out / "figures" / f"{drawn.name}.png"))
    page = _template().render(
        condition=shown[0].label(),
        scenes=measured.scenes(),
        run=run,
        headlines=headlines(measured, run.seed),
        comparison=comparison_table(table, shown),
        shared=shared_parts(shown) if len(shown) > 1 else shown[0].label(),
        pictures=pictures,
        trajectories=trajectory_table(table, shown),
        budget=budget_table(measured),
        baselines=baseline_table(primary),
        claims=claims_table(primary),
        calibration=calibration_table(measured),
        timing=timing_table(measured),
        live=live_table(measured),
        by_scene=scene_table(primary),
        controls=control_table(table, shown),
        failures=failure_table(measured),
        notes=list(notes),
        platform=published.PLATFORM,
    )
    (out / "report.html").write_text(page, encoding="utf-8")


def _embedded(drawn: ReportFigure, png: Path) -> Picture:
    """The saved picture, scaled down and compressed into a data URI."""
    with Image.open(png) as opened:
        image = opened.convert("RGB")
    if image.width > PICTURE_WIDTH_PX:
        height = round(image.height * PICTURE_WIDTH_PX / image.width)
        image = image.resize((PICTURE_WIDTH_PX, height), Image.Resampling.LANCZOS)
    packed = io.BytesIO()
    image.save(packed, "WEBP", quality=WEBP_QUALITY, method=4)
    data_uri = "data:image/webp;base64," + base64.b64encode(packed.getvalue()).decode("ascii")
    return Picture(
        drawn.name, drawn.title, drawn.caption, drawn.wide, data_uri, image.width, image.height
    )


def _template() -> Template:
    environment = Environment(
        loader=PackageLoader("evaluation", "report"),
        autoescape=select_autoescape(["html", "j2"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html.j2")
