"""Self-contained pages: pictures go into the HTML, and as PNG and PDF into a folder beside it."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from PIL import Image

from evaluation.figures.style import save_figure
from evaluation.showcase.figures import ReportFigure

PICTURE_WIDTH_PX = 1500
WEBP_QUALITY = 88


@dataclass(frozen=True)
class Picture:
    """A figure as a page embeds it."""

    name: str
    title: str
    caption: str
    wide: bool
    data_uri: str
    width: int
    height: int


def saved_picture(drawn: ReportFigure, out: Path) -> Picture:
    """Save a figure into `figures/` of a folder, and pack it for the page."""
    save_figure(drawn.figure, out / "figures", drawn.name)
    with Image.open(out / "figures" / f"{drawn.name}.png") as opened:
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


def rendered(template: str, **words: object) -> str:
    """A template of this folder, filled; all text is escaped."""
    environment = Environment(
        loader=PackageLoader("evaluation", "report"),
        autoescape=select_autoescape(["html", "j2"]),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(**words)
