"""One look for all figures: legible in print, safe for colour-blind readers."""

from __future__ import annotations

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import IO, Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

SERIES = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")
"""Colours of conditions, by Okabe and Ito."""
PAPER = "#D62246"
"""Colour of the paper's published values in every figure."""
INK = "#222222"
FAINT = "#8A8F98"
HOLE = "#EFF0F2"
"""Colour of cells and pixels without a value."""
DASHED = (0, (5, 3))
"""Line style of references: published values, limits, perfect agreement."""

HEIGHT_COLOURS = "viridis"
DEPTH_COLOURS = "viridis_r"
ERROR_COLOURS = "RdBu_r"
COST_COLOURS = LinearSegmentedColormap.from_list("cost", ["#000000", "#C4C8CE"])
"""Ends in grey, so that white lines stay visible on it."""

WIDE_IN, COLUMN_IN = 7.16, 3.5
"""Widths of figures [in]: both columns of a paper, or one. Print does not scale them."""
SMALL_PT = 7.0
"""The smallest text [pt]."""
LABEL_PT = 7.5
"""Legends, and labels inside the axes [pt]."""
PICTURE_DPI = 210
LAYOUT_ROUNDS = 2
"""Space for tick labels is known only after a first round has placed the axes."""

STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelcolor": INK,
    "axes.edgecolor": "#5A5F66",
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": False,
    "grid.color": "#D9DCE0",
    "grid.linewidth": 0.6,
    "text.color": INK,
    "xtick.color": "#3A3F45",
    "ytick.color": "#3A3F45",
    "legend.frameon": False,
    "legend.fontsize": LABEL_PT,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "figure.dpi": 100,
    "pdf.fonttype": 42,
    "svg.hashsalt": "airground",
}

styled = mpl.rc_context(STYLE)  # type: ignore[arg-type]
"""Decorator that gives a figure function this look."""


@dataclass(frozen=True)
class ReportFigure:
    """A figure with its heading and caption; `name` is that of its files, without ending.
    The caption names content, conditions, and the published value to compare with. A figure that is
    `wide` needs the full width of a page."""

    name: str
    title: str
    caption: str
    figure: Figure
    wide: bool = True


def colour_map(colours: str | Colormap, hole: str = HOLE) -> Colormap:
    """A colour map that shows NaN as `hole`."""
    named = mpl.colormaps[colours] if isinstance(colours, str) else colours
    return named.with_extremes(bad=hole)


def value_range(values: NDArray, low: float, high: float) -> tuple[float, float]:
    """Percentiles of the finite values, as limits of a colour map; 0 and 1 if there are none."""
    finite = values[np.isfinite(values)]
    if len(finite) == 0:
        return 0.0, 1.0
    lowest, highest = np.percentile(finite, [low, high])
    return float(lowest), float(highest)


def picture_axes(axes: Axes) -> None:
    """Remove ticks and frame around a picture."""
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)


def plain_numbers(axis: Axis) -> None:
    """Label a logarithmic axis with 0.01, 0.1, 1 in place of powers of ten."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def reference_line(axes: Axes, y: float, text: str) -> None:
    """A horizontal line at a published value, with its label at the right end."""
    axes.axhline(y, color=PAPER, linewidth=1.0, linestyle=DASHED)
    axes.text(
        1.005, y, text, transform=axes.get_yaxis_transform(), color=PAPER, va="center",
        fontsize=LABEL_PT,
    )  # fmt: skip


def save_picture(figure: Figure, folder: Path, name: str) -> None:
    """Write `name`.png into an existing folder; the same figure gives the same bytes."""
    write_png(figure, folder / f"{name}.png")


@styled
def write_png(figure: Figure, file: Path | IO[bytes]) -> None:
    """Write a figure as PNG; the same figure gives the same bytes."""
    _lay_out(figure)
    figure.savefig(file, format="png", dpi=PICTURE_DPI, metadata={"Software": None})


@styled
def save_figure(figure: Figure, folder: Path, name: str) -> None:
    """Write `name`.png and `name`.pdf; the same figure gives the same bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    save_picture(figure, folder, name)
    # To memory first: of a full disk Matplotlib's PDF writer makes an error of its own.
    pdf = BytesIO()
    figure.savefig(
        pdf,
        format="pdf",
        dpi=PICTURE_DPI,
        metadata={"CreationDate": None, "Producer": None, "Creator": None},
    )
    (folder / f"{name}.pdf").write_bytes(pdf.getvalue())


def _lay_out(figure: Figure) -> None:
    """Settle the layout of a figure and take its engine away, with which Matplotlib would draw the
    figure twice for each file."""
    engine = figure.get_layout_engine()
    if engine is None:
        return
    figure.set_dpi(PICTURE_DPI)
    for _ in range(LAYOUT_ROUNDS):
        engine.execute(figure)
    figure.set_layout_engine(None)
