"""Fig. 9 and 10: position error of a robot over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from evaluation.show.figures.style import HOLE, SERIES, WIDE_IN, reference_line, styled


@dataclass(frozen=True, eq=False)
class ErrorOverTime:
    """One run of one robot.

    Attributes:
        title: Name of the run.
        time_s: (N,) time since the first image [s].
        live_m: (N,) error of the pose at the time of its image [m], NaN where there was none.
        final_m: (N,) error of the same pose at the end of the run [m], NaN likewise.
    """

    title: str
    time_s: NDArray[np.float64]
    live_m: NDArray[np.float64]
    final_m: NDArray[np.float64]


@styled
def trajectory_error_figure(runs: Sequence[ErrorOverTime], paper_m: float) -> Figure:
    """One panel per run with a common scale, and the paper's RMS error [m] as a line."""
    figure = Figure(figsize=(WIDE_IN, 0.7 + 1.85 * len(runs)), layout="constrained")
    panels = figure.subplots(len(runs), 1, squeeze=False, sharey=True)[:, 0]
    for axes, run in zip(panels, runs, strict=True):
        _shade_gaps(axes, run)
        axes.plot(run.time_s, 100 * run.live_m, color=SERIES[0], linewidth=1.3, label="live")
        axes.plot(run.time_s, 100 * run.final_m, color=SERIES[1], linewidth=1.3, label="final")
        reference_line(axes, 100 * paper_m, f"paper\n{100 * paper_m:g} cm RMS")
        live, final = _rms(run.live_m), _rms(run.final_m)
        axes.set_title(f"{run.title}: RMS {100 * live:.2f} cm live, {100 * final:.2f} cm final")
        axes.set_xlim(run.time_s[0], run.time_s[-1])
        axes.set_ylabel("error [cm]")
        axes.grid(axis="y")
    drawn = np.concatenate([[paper_m], *(e for run in runs for e in (run.live_m, run.final_m))])
    panels[0].set_ylim(0, 1.12 * 100 * drawn[np.isfinite(drawn)].max())
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
