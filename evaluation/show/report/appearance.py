"""The report on image matching: on what its success depends (Fig. 3)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from evaluation.measure.baselines.appearance import STAGE, USUAL_ANGLE_DEG
from evaluation.setup.condition import Condition
from evaluation.show.figures.fig03_appearance import Curve, appearance_figure
from evaluation.show.figures.style import ReportFigure
from evaluation.table.limits import LOCATED_M
from evaluation.table.rows import TRIAL_KEYS, ResultTable

LABELS = {
    "view_angle_deg": "angle between the views [°]",
    "light_turn_deg": "turn of the light between the images [°]",
    "printed": "share of the boxes with print",
}
METHODS = {"": "ASIFT", "xfeat_": "XFeat and LighterGlue", "disk_": "DISK and LightGlue"}
"""Beginning of the metrics of a method -> its name."""
_KEYS = [key for key in TRIAL_KEYS if key != "sequence"]


def appearance_figures(table: ResultTable, condition: Condition) -> Iterator[ReportFigure]:
    """Curves of one condition's rows, a figure for each method; none where no pair of images was
    matched."""
    pairs = appearance_pairs(table)
    for method, title in METHODS.items():
        if f"{method}located" not in pairs:
            continue
        curves = {
            label: {
                str(scene): _curve(found, varied, method)
                for scene, found in pairs.groupby("scene", sort=False)
                if varied in found["varied"].to_numpy()
            }
            for varied, label in LABELS.items()
        }
        yield ReportFigure(
            f"fig03_appearance_{method}".rstrip("_"),
            f"Fig. 3: on what matching by {title} depends",
            f"One image of each robot, matched by {title}; depth and faults of the cameras as in "
            f"recordings ({condition.sensors} sensors). Above: share of pairs from which the "
            f"MAV's camera is located within {LOCATED_M:g} m, with 95 % Wilson intervals. Below: "
            "matches that agree with the true pose; dots are pairs, lines medians. One condition "
            f"varies at a time; otherwise views are {USUAL_ANGLE_DEG:g}° apart in the same light, "
            f"and boxes are printed as in the scene. {len(pairs)} pairs.",
            appearance_figure({label: of for label, of in curves.items() if of}),
        )


def appearance_pairs(table: ResultTable) -> pd.DataFrame:
    """One row a pair of images: its conditions and results, and `varied`, the condition that is
    not the usual one."""
    frame = table.frame[table.frame["stage"] == STAGE]
    wide = frame.pivot(index=_KEYS, columns="metric", values="value")
    notes = frame[frame["metric"] == "located"].set_index(_KEYS)["note"]
    return wide.assign(varied=notes).reset_index()


def _curve(pairs: pd.DataFrame, varied: str, method: str) -> Curve:
    """The pairs in which one condition varies, and the usual ones, as one method matched them."""
    chosen = pairs[pairs["varied"].isin([varied, ""])]
    values, right, located = (
        chosen[name].to_numpy(np.float64)
        for name in (varied, f"{method}right_matches", f"{method}located")
    )
    return Curve(values, right, located > 0)
