"""Front ends beside each other on one recording: how far each is off over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.figures.style import SERIES, WIDE_IN, styled


@dataclass(frozen=True, eq=False)
class FrontEndError:
    """One front end on the recording.

    Attributes:
        name: As on the command line.
        time_s: (N,) of its poses since the first image [s].
        error_m: (N,) of their positions after SE3 alignment [m].
        tracked: Share of the images that got a pose.
    """

    name: str
    time_s: NDArray[np.float64]
    error_m: NDArray[np.float64]
    tracked: float


@styled
def front_ends_figure(title: str, errors: Sequence[FrontEndError]) -> Figure:
    """One curve a front end, with its RMS error and how many images it tracked."""
    figure = Figure(figsize=(WIDE_IN, 3.2), layout="constrained")
    axes = figure.subplots()
    for colour, one in zip(SERIES, errors, strict=False):
        rms = float(np.sqrt(np.mean(one.error_m**2)))
        label = f"{one.name}: {100 * rms:.1f} cm RMS, {one.tracked:.0%} tracked"
        axes.plot(one.time_s, 100 * one.error_m, color=colour, linewidth=1.5, label=label)
    axes.set_title(title)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("position error after SE3 alignment [cm]")
    axes.set_ylim(bottom=0)
    axes.grid(axis="y")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure
