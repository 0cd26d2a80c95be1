"""One look for all figures: calm, legible small, safe for colour-blind readers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.figure import Figure

SERIES = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")
"""Okabe and Ito's colours, one a condition."""
PAPER = "#D62246"
"""The paper's published values, everywhere."""
INK = "#222222"
FAINT = "#8A8F98"
HOLE = "#EFF0F2"
"""Cells and pixels without a value."""

HEIGHT_COLOURS = "viridis"
DEPTH_COLOURS = "viridis_r"
ERROR_COLOURS = "RdBu_r"
COST_COLOURS = LinearSegmentedColormap.from_list("cost", ["#000000", "#C4C8CE"])
"""Ends in grey, so that white lines stay visible on it."""

WIDE_IN, COLUMN_IN = 7.16, 3.5
"""Widths of figures: both columns of a paper, or one of them. Nothing is scaled in print."""
SMALL_PT = 7.0
"""The smallest text."""

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
    "legend.fontsize": 7.5,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "figure.dpi": 100,
    "pdf.fonttype": 42,
    "svg.hashsalt": "airground",
}

styled = mpl.rc_context(STYLE)  # type: ignore[arg-type]
"""Decorator that gives a figure function this look."""

PICTURE_DPI = 210


def colour_map(colours: str | Colormap, hole: str = HOLE) -> Colormap:
    """A colour map that shows NaN as `hole`."""
    named = mpl.colormaps[colours] if isinstance(colours, str) else colours
    return named.with_extremes(bad=hole)


def picture_axes(axes: Axes) -> None:
    """Strip what a picture does not need."""
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)


@styled
def save_picture(figure: Figure, folder: Path, name: str) -> None:
    """Write `name`.png into a folder that exists; the same figure gives the same bytes."""
    figure.savefig(folder / f"{name}.png", dpi=PICTURE_DPI, metadata={"Software": None})


@styled
def save_figure(figure: Figure, folder: Path, name: str) -> None:
    """Write `name`.png and `name`.pdf; the same figure gives the same bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    save_picture(figure, folder, name)
    # The layout is found; finding it again costs as much as drawing.
    figure.set_layout_engine("none")
    figure.savefig(
        folder / f"{name}.pdf",
        dpi=PICTURE_DPI,
        metadata={"CreationDate": None, "Producer": None, "Creator": None},
    )
