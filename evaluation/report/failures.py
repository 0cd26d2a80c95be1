"""What went wrong, and what was rightly refused."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from evaluation.report.tables import MISSING, TextTable, degrees, metres
from evaluation.results.table import Condition, ResultTable


def control_table(table: ResultTable, conditions: Sequence[Condition]) -> TextTable:
    """Control scenes: there the only right answer is to claim nothing."""
    rows = []
    for condition in conditions:
        part = table.of(condition).controls()
        converged = part.sequences("converged")
        if len(converged) == 0:
            continue
        ever = np.nanmax(converged.to_numpy(np.float64), axis=1) > 0
        notes = part.rows("localization", "converged")["note"]
        said = notes[notes != ""].value_counts()
        reason = f"{said.index[0]} ({said.iloc[0]} of {len(notes)} updates)" if len(said) else ""
        rows.append(
            (
                ", ".join(part.scenes()),
                condition.label(),
                f"{int(ever.sum())} of {len(ever)}",
                reason or MISSING,
            )
        )
    header = ("scene", "condition", "ever claimed a position", "why not, mostly")
    return TextTable(header, tuple(rows))


def failure_table(table: ResultTable) -> TextTable:
    """Every failure of one condition: sequences beyond 0.25 m after 4, refinements off."""
    rows = [*_failed_sequences(table), *_failed_trials(table)]
    return TextTable(("what", "scene", "flight", "number", "result", "said"), tuple(rows))


def _failed_sequences(table: ResultTable) -> list[tuple[str, ...]]:
    errors = table.sequences("error_m")
    if len(errors) == 0:
        return []
    judged = min(4, errors.shape[1])
    notes = table.rows("localization", "converged").set_index(
        ["scene", "seed", "flight", "sequence", "iteration"]
    )["note"]
    rows: list[tuple[str, ...]] = []
    for key, error in zip(errors.index.to_list(), errors.to_numpy(np.float64), strict=True):
        off, finally_off = error[judged - 1], error[-1]
        if off <= 0.25:
            continue
        scene, _, flight, sequence = key
        result = f"{_off(off)} after {judged}, {_off(finally_off)} after {len(error)}"
        said = str(notes.get((*key, judged), "")) or "position claimed"
        rows.append(("sequence", str(scene), str(flight), str(sequence), result, said))
    return rows


def _failed_trials(table: ResultTable) -> list[tuple[str, ...]]:
    trials = table.trials()
    if "after_translation_m" not in trials:
        return []
    notes = table.rows("refinement", "accepted").set_index(["scene", "seed", "flight", "trial"])
    rows: list[tuple[str, ...]] = []
    accepted_at = trials["accepted"] if "accepted" in trials else pd.Series(1.0, trials.index)
    for key, metres_off, degrees_off, accepted_value in zip(
        trials.index.to_list(),
        trials["after_translation_m"],
        trials["after_rotation_deg"],
        accepted_at,
        strict=True,
    ):
        scene, seed, flight, _, number = key
        accepted = accepted_value > 0
        if accepted and metres_off <= 0.05 and degrees_off <= 2.0:
            continue
        note = notes["note"].get((scene, seed, flight, number), "") if len(notes) else ""
        result = f"{_off(metres_off)}, {degrees(degrees_off)}"
        said = f"refused: {note}" if not accepted else "accepted"
        rows.append(("refinement", str(scene), str(flight), str(number), result, said))
    return rows


def _off(metres_off: float) -> str:
    return metres(metres_off) if np.isfinite(metres_off) else "no estimate"
