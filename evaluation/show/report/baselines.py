"""Baselines beside ours: which methods find the MAV from one aerial map, and which err."""

from __future__ import annotations

import numpy as np
import pandas as pd

from evaluation.measure.baselines.interface import Baseline
from evaluation.measure.baselines.measure import STAGE
from evaluation.measure.baselines.table import BASELINES
from evaluation.setup.text import MISSING, TextTable, degrees, metres, milliseconds
from evaluation.table.intervals import quantile, wilson
from evaluation.table.limits import GOOD_POSE, LOCATED_M, is_good_pose
from evaluation.table.rows import TRIAL_KEYS, ResultTable

HEADER = (
    "method",
    "is given",
    "n",
    f"claims a place within {LOCATED_M:g} m",
    "wrong claims",
    f"claims within {GOOD_POSE}",
    f"best guess within {LOCATED_M:g} m",
    "best guess, median error",
    "median time [ms]",
)


def baseline_table(table: ResultTable) -> TextTable:
    """One row a baseline; no rows where none was tried (of one condition).
    Where control scenes were flown over too, a last column counts the claims there."""
    measured, controls = table.scored(), table.controls()
    rows = [(baseline, _cells(measured, baseline)) for baseline in BASELINES]
    tried = [(baseline, cells) for baseline, cells in rows if cells]
    if len(controls) == 0 or len(controls) == len(table):
        return TextTable(HEADER, tuple(cells for _, cells in tried))
    return TextTable(
        (*HEADER, "claims on flat ground"),
        tuple((*cells, _claims(controls, baseline)) for baseline, cells in tried),
    )


def _cells(table: ResultTable, baseline: Baseline) -> tuple[str, ...]:
    """A row; empty where the baseline was not asked for."""
    missing = table.rows(STAGE, f"{baseline.name}_missing")
    if len(missing):
        not_run = f"not run\n{missing['note'].iloc[0]}"
        return (baseline.title, baseline.given, "0", not_run, *[MISSING] * 5)
    trials = baseline_trials(table, baseline.name)
    n = len(trials)
    if n == 0:
        return ()
    claimed = trials["claimed"] > 0
    near = trials["horizontal_m"] <= LOCATED_M
    precise = is_good_pose(trials["translation_m"], trials["rotation_deg"])
    shares = (claimed & near, claimed & ~near, claimed & precise, near)
    off_m, off_deg = (quantile(trials[c], 0.5) for c in ("translation_m", "rotation_deg"))
    return (
        baseline.title,
        baseline.given,
        str(n),
        *(wilson(int(share.sum()), n).text() for share in shares),
        f"{metres(off_m)}\n{degrees(off_deg)}",
        milliseconds(quantile(trials["ms"], 0.5)),
    )


def _claims(table: ResultTable, baseline: Baseline) -> str:
    claimed = baseline_trials(table, baseline.name)["claimed"] > 0
    return wilson(int(claimed.sum()), len(claimed)).text()


def baseline_trials(table: ResultTable, name: str) -> pd.DataFrame:
    """One row a trial with columns claimed, horizontal_m, translation_m, rotation_deg and ms.
    What has no guess has NaN errors, which lie within no limit."""
    columns = ("claimed", "horizontal_m", "translation_m", "rotation_deg", "ms")
    metrics = {f"{name}_{column}": column for column in columns}
    frame = table.frame[(table.frame["stage"] == STAGE) & table.frame["metric"].isin(metrics)]
    keys = [key for key in TRIAL_KEYS if key != "sequence"]
    wide = frame.pivot(index=keys, columns="metric", values="value").rename(columns=metrics)
    return wide.reindex(columns=list(columns)).astype(np.float64)
