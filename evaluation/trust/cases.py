"""The cases in which there is no place to find, though the scene holds one."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Case:
    """One kind of negative.

    Attributes:
        stage: Of its rows. Metrics are `converged` and `error_m` of localizations, by sequence
            and iteration; `accepted`, `after_translation_m` and `after_rotation_deg` of
            refinements, by trial. Without a truth there are no errors.
        number: Seeds its draws.
        has_truth: Whether the MAV is somewhere in the frame of the ground map, though off it.
    """

    stage: str
    number: int
    has_truth: bool


NO_OVERLAP = Case("no_overlap", 0, has_truth=True)
WRONG_MAP = Case("wrong_map", 1, has_truth=False)
CASES = (NO_OVERLAP, WRONG_MAP)
