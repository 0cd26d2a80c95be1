"""Failed sequences and refinements step by step, and the claims in control scenes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from evaluation.setup.condition import Condition
from evaluation.setup.text import MISSING, TextTable, degrees, formatted, metres
from evaluation.table.limits import FOURTH_MAP, LOCATED_M, is_good_pose
from evaluation.table.rows import SEQUENCE_KEYS, ResultTable


@dataclass(frozen=True)
class Failure:
    """A sequence that did not find its place, or a refinement that did not end there.

    Attributes:
        kind: "sequence" or "refinement".
        place: Scene, seed, flight, and number of the sequence or trial.
        said: What the pipeline reported: a claim, or the reason of a refusal.
        story: The errors step by step.
        at_s: When, on the sensors' clock [s]; None where nothing was made.
    """

    kind: str
    place: tuple[str, int, int, int]
    result: str
    said: str
    story: TextTable
    at_s: float | None

    @property
    def key(self) -> tuple[str, str, int, int, int]:
        """What names the same trial in another run."""
        return self.kind, *self.place

    @property
    def title(self) -> str:
        scene, seed, flight, number = self.place
        return f"{self.kind} {number} of {scene}, seed {seed}, flight {flight}"


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
        claims = f"{int(ever.sum())} of {len(ever)}"
        rows.append((", ".join(part.scenes()), condition.label(), claims, reason or MISSING))
    header = ("scene", "condition", "ever claimed a position", "why not, mostly")
    return TextTable(header, tuple(rows))


def failures(table: ResultTable) -> list[Failure]:
    """Every failure of one condition: sequences off after four maps, refinements not good."""
    return [*_failed_sequences(table), *_failed_trials(table)]


def _failed_sequences(table: ResultTable) -> Iterator[Failure]:
    errors, spreads = table.sequences("error_m"), table.sequences("spread_m")
    if len(errors) == 0:
        return
    judged = min(FOURTH_MAP, errors.shape[1])
    rows = table.rows("localization", "converged").set_index([*SEQUENCE_KEYS, "iteration"])
    notes, times = rows["note"], rows["time_s"]
    each = (frame.to_numpy(np.float64) for frame in (errors, spreads))
    for key, error, spread in zip(errors.index.to_list(), *each, strict=True):
        if error[judged - 1] <= LOCATED_M:
            continue
        said = [
            str(notes.get((*key, n), "")) or "position claimed" for n in range(1, len(error) + 1)
        ]
        when = [_seconds(times.get((*key, n))) for n in range(1, len(error) + 1)]
        steps = tuple(
            (str(n), formatted(at_s, "{:.2f} s"), _off(off), metres(wide), words)
            for n, (at_s, off, wide, words) in enumerate(
                zip(when, error, spread, said, strict=True), 1
            )
        )
        result = f"{_off(error[judged - 1])} after {judged}"
        if len(error) > judged:
            result += f", {_off(error[-1])} after {len(error)}"
        scene, seed, flight, sequence = key
        yield Failure(
            "sequence",
            (str(scene), int(seed), int(flight), int(sequence)),
            result,
            said[judged - 1],
            TextTable(("aerial map", "time", "error", "spread", "result"), steps),
            when[judged - 1],
        )


def _failed_trials(table: ResultTable) -> Iterator[Failure]:
    trials = table.trials()
    if "after_translation_m" not in trials:
        return
    rows = table.rows("refinement", "accepted")
    by_trial = rows.set_index(["scene", "seed", "flight", "trial"])
    notes, times = by_trial["note"], by_trial["time_s"]
    for key, trial in zip(trials.index.to_list(), trials.to_dict("records"), strict=True):
        accepted = trial.get("accepted", 1.0) > 0
        off_m, off_deg = trial["after_translation_m"], trial["after_rotation_deg"]
        if accepted and is_good_pose(off_m, off_deg):
            continue
        scene, seed, flight, _, number = key
        steps = tuple(
            (title, _off(trial[f"{when}_translation_m"]), degrees(trial[f"{when}_rotation_deg"]))
            for when, title in _MOMENTS
            if f"{when}_translation_m" in trial
        )
        yield Failure(
            "refinement",
            (str(scene), int(seed), int(flight), int(number)),
            f"{_off(off_m)}, {degrees(off_deg)}",
            "accepted" if accepted else f"refused: {notes.get((scene, seed, flight, number), '')}",
            TextTable(("when", "position error", "angle error"), steps),
            _seconds(times.get((scene, seed, flight, number))),
        )


_MOMENTS = (
    ("before", "at the start"),
    ("after", "after refinement"),
    ("from_truth", "the same, started at the truth"),
)


def _seconds(time_s: object) -> float | None:
    """A time of a table, which has none where nothing was made."""
    return time_s if isinstance(time_s, float) and np.isfinite(time_s) else None


def _off(metres_off: float) -> str:
    return metres(metres_off) if np.isfinite(metres_off) else "no estimate"
