"""Fig. 9 and 10: how far a robot's estimated position is off over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.show.figures.style import HOLE, PAPER, SERIES, WIDE_IN, styled


@dataclass(frozen=True, eq=False)
class ErrorOverTime:
    """One run of one robot.

    Attributes:
        title: Which run.
        time_s: (N,) since the first image [s].
        live_m: (N,) error of the pose as it was said then [m], NaN where there was none.
        final_m: (N,) error of the pose as it was believed at the end [m], likewise.
    """

    title: str
    time_s: NDArray[np.float64]
    live_m: NDArray[np.float64]
    final_m: NDArray[np.float64]


@styled
def trajectory_error_figure(runs: Sequence[ErrorOverTime], paper_m: float) -> Figure:
    """One panel a run: live and final poses, gaps, and the paper's RMS error.

    Args:
        runs: To be drawn below each other, with the same scale.
        paper_m: RMS error of the paper [m].
    """
    figure = Figure(figsize=(WIDE_IN, 0.7 + 1.85 * len(runs)), layout="constrained")
    panels = figure.subplots(len(runs), 1, squeeze=False, sharey=True)[:, 0]
    for axes, run in zip(panels, runs, strict=True):
        _shade_gaps(axes, run)
        axes.plot(run.time_s, 100 * run.live_m, color=SERIES[0], linewidth=1.3, label="live")
        axes.plot(run.time_s, 100 * run.final_m, color=SERIES[1], linewidth=1.3, label="final")
        axes.axhline(100 * paper_m, color=PAPER, linewidth=1.0, linestyle=(0, (5, 3)))
        axes.text(
            1.005, 100 * paper_m, f"paper\n{100 * paper_m:g} cm RMS", color=PAPER,
            transform=axes.get_yaxis_transform(), va="center", fontsize=7.5,
        )  # fmt: skip
        live, final = _rms(run.live_m), _rms(run.final_m)
        axes.set_title(f"{run.title}: RMS {100 * live:.2f} cm live, {100 * final:.2f} cm final")
        axes.set_xlim(run.time_s[0], run.time_s[-1])
        axes.set_ylabel("error [cm]")
        axes.grid(axis="y")
    panels[0].set_ylim(0, 1.12 * max(100 * paper_m, *(_largest(run) for run in runs)))
    panels[-1].set_xlabel("time since the first image [s]; grey: no pose")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure


def _shade_gaps(axes: Axes, run: ErrorOverTime) -> None:
    """Grey where the robot had no pose."""
    step = float(np.median(np.diff(run.time_s))) if len(run.time_s) > 1 else 0.0
    for time_s in run.time_s[np.isnan(run.live_m)]:
        axes.axvspan(time_s, time_s + step, color=HOLE, linewidth=0, zorder=0)


def _rms(error_m: NDArray[np.float64]) -> float:
    known = error_m[np.isfinite(error_m)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def _largest(run: ErrorOverTime) -> float:
    """The largest error drawn [cm]."""
    errors = np.concatenate([run.live_m, run.final_m])
    errors = errors[np.isfinite(errors)]
    return float(100 * errors.max()) if len(errors) else 0.0
