"""Writes result rows of one recording under one condition."""

from __future__ import annotations

from functools import partial

from airground.core.belief import Alignment, Belief
from evaluation.setup.condition import Condition
from evaluation.table.rows import Row
from evaluation.table.truth_errors import PoseError


class RowWriter:
    """Collects rows that share their recording and their condition.

    Args:
        scene, seed, flight: Which recording.
        condition: Under what it is measured.
    """

    def __init__(self, scene: str, seed: int, flight: int, condition: Condition) -> None:
        self.rows: list[Row] = []
        self._shared = (scene, seed, flight, condition)

    def add(
        self,
        stage: str,
        metric: str,
        value: float,
        unit: str,
        *,
        sequence: int | None = None,
        iteration: int | None = None,
        trial: int | None = None,
        time_s: float | None = None,
        note: str = "",
    ) -> None:
        """One row; `Row` describes the fields."""
        what = (stage, metric, float(value), unit)
        self.rows.append(Row(*self._shared, *what, sequence, iteration, trial, note, time_s))

    def add_belief(
        self,
        belief: Belief,
        error: PoseError,
        squared_mahalanobis: float,
        sequence: int,
        iteration: int,
        origin: str = "",
    ) -> None:
        """A filter's belief after one aerial map, and its error (Fig. 11, 12).
        `origin` states how it was made, where not by the pipeline itself."""
        add = partial(
            self.add,
            "localization",
            sequence=sequence,
            iteration=iteration,
            time_s=belief.stamp_ns * 1e-9,
        )
        add("error_m", error.horizontal_m, "m", note=origin)
        add("error_deg", error.rotation_deg, "deg")
        add("spread_m", belief.spread_m, "m")
        add("squared_mahalanobis", squared_mahalanobis, "")
        add("converged", belief.converged, "", note=belief.refusal)

    def add_no_belief(self, reason: str, sequence: int, iteration: int) -> None:
        """An aerial map that was not made: counts as failed."""
        add = partial(self.add, "localization", sequence=sequence, iteration=iteration, note=reason)
        add("error_m", float("nan"), "m")
        add("error_deg", float("nan"), "deg")
        add("converged", 0.0, "")

    def add_alignment(
        self,
        alignment: Alignment,
        errors: dict[str, PoseError],
        trial: int,
        stage: str = "refinement",
    ) -> None:
        """A refinement (Fig. 13, 14): errors by time, "before" and "after" among them."""
        add = partial(self.add, stage, trial=trial, time_s=alignment.stamp_ns * 1e-9)
        for when, error in errors.items():
            add(f"{when}_translation_m", error.translation_m, "m")
            add(f"{when}_rotation_deg", error.rotation_deg, "deg")
        add("accepted", alignment.accepted, "", note=alignment.refusal)
