"""Calibration of the particles: coverage of their ellipses, and their spread against the error."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from evaluation.judge.claims import ELLIPSES, Localizations
from evaluation.show.figures.style import (
    DASHED,
    FAINT,
    INK,
    SERIES,
    SMALL_PT,
    WIDE_IN,
    plain_numbers,
    styled,
)

NOMINAL = np.linspace(0.01, 0.99, 99)
"""Shares of a Gaussian at which coverage is computed."""


@styled
def calibration_figure(found: Localizations) -> Figure:
    """Nominal against observed coverage, and spread against error, of at least one localization."""
    figure = Figure(figsize=(WIDE_IN, 3.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    _coverage(left, found)
    _spread_against_error(right, found)
    return figure


def _coverage(axes: Axes, found: Localizations) -> None:
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
    axes.text(32, 35, "ideal", rotation=45, rotation_mode="anchor", fontsize=SMALL_PT)
    axes.set_xlabel("share of a Gaussian inside the ellipse [%]")
    axes.set_ylabel("true positions inside the ellipse [%]")
    axes.set_title("coverage of the beliefs' ellipses")
    _square(axes, 0, 100, 101.5)


def _spread_against_error(axes: Axes, found: Localizations) -> None:
    for chosen, name, colour in (
        (~found.accepted, "no position claimed", FAINT),
        (found.accepted, "accepted", SERIES[0]),
    ):
        axes.plot(
            found.spread_m[chosen], found.error_m[chosen], "o", color=colour, alpha=0.55,
            markersize=3.2, markeredgewidth=0, label=f"{name} ({int(chosen.sum())})",
            rasterized=True,
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    plain_numbers(axes.xaxis)
    plain_numbers(axes.yaxis)
    axes.set_xlabel("spread of the particles [m]")
    axes.set_ylabel("horizontal error [m]")
    axes.set_title("one dot per aerial map; dashed: equal")
    low, high = _limits(found)
    _square(axes, low, high, high)


def _square(axes: Axes, low: float, high: float, end: float) -> None:
    """The same range on both axes, with the diagonal."""
    axes.plot([low, high], [low, high], color=INK, linewidth=1.0, linestyle=DASHED, zorder=1.9)
    axes.set(xlim=(low, end), ylim=(low, end))
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
