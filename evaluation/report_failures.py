"""What went wrong, and what was rightly refused."""

from __future__ import annotations

from collections.abc import Sequence

from evaluation.report_tables import MISSING, TextTable, degrees, metres
from evaluation.results import Condition, ResultTable


def control_table(table: ResultTable, conditions: Sequence[Condition]) -> TextTable:
    """Control scenes: there the only right answer is to claim nothing."""
    rows = []
    for condition in conditions:
        part = table.of(condition).controls()
        converged = part.sequences("converged")
        if len(converged) == 0:
            continue
        ever = (converged.to_numpy(float) > 0).any(axis=1)
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
    judged = min(4, int(errors.columns[-1]))
    last = errors.columns[-1]
    notes = table.rows("localization", "converged").set_index(
        ["scene", "seed", "flight", "sequence", "iteration"]
    )["note"]
    rows = []
    for key, error in errors.iterrows():
        if error[judged] <= 0.25:
            continue
        scene, _, flight, sequence = key  # type: ignore[misc]
        result = f"{metres(error[judged])} after {judged}, {metres(error[last])} after {last}"
        said = str(notes.get((*key, judged), "")) or "position claimed"  # type: ignore[misc]
        result = result.replace(MISSING, "no estimate")
        rows.append(("sequence", str(scene), str(flight), str(sequence), result, said))
    return rows


def _failed_trials(table: ResultTable) -> list[tuple[str, ...]]:
    trials = table.trials()
    if "after_translation_m" not in trials:
        return []
    notes = table.rows("refinement", "accepted").set_index(["scene", "seed", "flight", "trial"])
    rows = []
    for key, trial in trials.iterrows():
        scene, seed, flight, _, number = key  # type: ignore[misc]
        metres_off, degrees_off = trial["after_translation_m"], trial["after_rotation_deg"]
        accepted = trial.get("accepted", 1.0) > 0
        if accepted and metres_off <= 0.05 and degrees_off <= 2.0:
            continue
        note = notes["note"].get((scene, seed, flight, number), "") if len(notes) else ""
        result = f"{metres(metres_off)}, {degrees(degrees_off)}".replace(MISSING, "no estimate")
        said = f"refused: {note}" if not accepted else "accepted"
        rows.append(("refinement", str(scene), str(flight), str(number), result, said))
    return rows
