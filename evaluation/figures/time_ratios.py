"""How much longer each stage takes than in a reference, as ratios of medians."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from evaluation.figures.style import INK, WIDE_IN, styled


@styled
def time_ratio_figure(
    ratios: dict[str, list[float | None]], labels: Sequence[str], colours: Sequence[str]
) -> Figure:
    """One row a stage, one dot a run; the line is the reference.

    Args:
        ratios: Title of a stage -> its ratio in each run, None where one was not measured.
        labels, colours: One a run.
    """
    figure = Figure(figsize=(WIDE_IN, 0.27 * len(ratios) + 0.95), layout="constrained")
    axes = figure.subplots()
    axes.axvline(1.0, color=INK, linewidth=1.0)
    for column, (label, colour) in enumerate(zip(labels, colours, strict=True)):
        shift = 0.18 * (column - (len(labels) - 1) / 2)
        for row, values in enumerate(ratios.values()):
            ratio = values[column]
            if ratio is not None:
                axes.hlines(row + shift, min(1.0, ratio), max(1.0, ratio), color=colour, alpha=0.4)
                axes.plot(ratio, row + shift, "o", color=colour, markersize=5.5)
        axes.plot([], [], "o", color=colour, label=label)
    reach = 1.15 * max(max(r, 1 / r) for values in ratios.values() for r in values if r)
    axes.set_xscale("log")
    axes.set_xlim(1 / max(reach, 1.5), max(reach, 1.5))
    axes.xaxis.set_major_locator(LogLocator(base=10, subs=(0.25, 0.5, 0.7, 1.0, 1.4, 2.0, 4.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_yticks(range(len(ratios)), list(ratios))
    axes.set_ylim(len(ratios) - 0.4, -0.6)
    axes.set_xlabel("median time over that of the reference")
    axes.grid(axis="x")
    figure.legend(loc="outside upper left", ncols=3)
    return figure
