"""Whether the particles' spread tells the error: ellipses that hold it, and dot by dot."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from evaluation.judge.claims import ELLIPSES, Localizations
from evaluation.show.figures.style import FAINT, INK, SERIES, SMALL_PT, WIDE_IN, styled

NOMINAL = np.linspace(0.01, 0.99, 99)


@styled
def calibration_figure(found: Localizations) -> Figure:
    """Nominal against observed coverage, and spread against error; accepted ones apart.

    Args:
        found: At least one localization.
    """
    figure = Figure(figsize=(WIDE_IN, 3.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    _coverage(left, found)
    _spread_against_error(right, found)
    return figure


def _coverage(axes: Axes, found: Localizations) -> None:
    axes.plot([0, 100], [0, 100], color=INK, linewidth=1.0, linestyle=(0, (5, 3)))
    axes.text(32, 35, "as it should be", rotation=45, rotation_mode="anchor", fontsize=SMALL_PT)
    groups = (("all", found, FAINT), ("accepted", found.only_accepted(), SERIES[0]))
    for shift, (name, part, colour) in enumerate(groups):
        if len(part) == 0:
            continue
        observed = [100 * part.coverage(share).share for share in NOMINAL]
        axes.plot(100 * NOMINAL, observed, color=colour, label=f"{name} ({len(part)})")
        for share in ELLIPSES:
            rate = part.coverage(share)
            # Side by side, so that neither interval hides the other.
            x = 100 * share + (shift - 0.5) * 1.4
            axes.vlines(x, 100 * rate.low, 100 * rate.high, color=colour, linewidth=1.6)
            axes.plot(x, 100 * rate.share, "o", color=colour, markersize=4.5)
    axes.set_xlim(0, 101.5)
    axes.set_ylim(0, 101.5)
    axes.set_xlabel("share of a Gaussian that the ellipse holds [%]")
    axes.set_ylabel("true positions in it [%]")
    axes.set_title("coverage of the particles' ellipses")
    axes.grid()
    axes.legend(loc="best")


def _spread_against_error(axes: Axes, found: Localizations) -> None:
    for chosen, name, colour in (
        (~found.accepted, "no position claimed", FAINT),
        (found.accepted, "accepted", SERIES[0]),
    ):
        axes.plot(
            found.spread_m[chosen],
            found.error_m[chosen],
            "o",
            color=colour,
            alpha=0.55,
            markersize=3.2,
            markeredgewidth=0,
            label=f"{name} ({int(chosen.sum())})",
            rasterized=True,
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    low, high = _limits(found)
    axes.plot([low, high], [low, high], color=INK, linewidth=1.0, linestyle=(0, (5, 3)))
    axes.set_xlim(low, high)
    axes.set_ylim(low, high)
    axes.set_xlabel("spread of the particles [m]")
    axes.set_ylabel("horizontal error [m]")
    axes.set_title("one dot an aerial map; dashed: equal")
    axes.grid()
    axes.legend(loc="best")


def _limits(found: Localizations) -> tuple[float, float]:
    """Round both axes' range outwards to steps of 1, 2, 5."""
    values = np.concatenate([found.spread_m, found.error_m])
    values = values[np.isfinite(values) & (values > 0)]
    if len(values) == 0:
        return 1e-3, 1.0
    steps = np.outer(10.0 ** np.arange(-6, 4), (1, 2, 5)).ravel()
    low = steps[max(np.searchsorted(steps, values.min(), side="right") - 1, 0)]
    high = steps[min(np.searchsorted(steps, values.max()), len(steps) - 1)]
    return float(low), float(max(high, 2 * low))
