"""Many cases, one after another, and the table of what they claim."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from airground.config import Config
from airground.core.belief import Alignment, Belief
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.refinement import refine
from evaluation.setup.setups import with_localization
from evaluation.table.intervals import wilson
from evaluation.table.limits import LOCATED_M, is_good_pose
from evaluation.table.truth_errors import PoseError, relative_error
from tests.negatives.flights import flights
from tests.negatives.kinds import NEGATIVES, PLACES
from tests.negatives.views import Flown, Points, View

MAPS = 4
"""Aerial maps of a case, for one filter."""
SEARCHED = 4
"""The heading is searched in one case out of so many, which takes most of the time."""
KINDS = NEGATIVES | PLACES
ORDER = (*NEGATIVES, *NEGATIVES, *PLACES)
"""Kinds of successive cases, again and again."""


@dataclass(frozen=True)
class Outcome:
    """What one aerial map led to.

    Attributes:
        number: Number of the case; with the seed, it repeats the case.
        step: Number of the aerial map in the case, from 1.
        kind: Kind of the case.
        searched: Whether the heading is searched.
        claimed, claimed_wrongly: Whether a position is claimed, and whether that is wrong.
        aligned: Whether refinement was tried: after each claim, as the pipeline does, and from the
            best guess after the last map of a case.
        accepted, accepted_wrongly: Whether the alignment is accepted, and whether that is wrong.
        refusals: Reasons of localization and refinement.
        off_m: Horizontal error of the claim [m]; NaN without a place.
    """

    number: int
    step: int
    kind: str
    searched: bool
    claimed: bool
    claimed_wrongly: bool
    aligned: bool
    accepted: bool
    accepted_wrongly: bool
    refusals: tuple[str, str]
    off_m: float

    @property
    def is_wrong(self) -> bool:
        """As the pipeline runs, without alignments that no claim allows."""
        return self.claimed_wrongly or (self.claimed and self.accepted_wrongly)

    def line(self) -> str:
        """What happened, for people."""
        heading = "searched" if self.searched else "known"
        verdict = "claimed" if self.claimed else self.refusals[0]
        aligned = "accepted" if self.accepted else self.refusals[1] or "not tried"
        place = f", off by {self.off_m:.2f} m" if np.isfinite(self.off_m) else ""
        return (
            f"#{self.number} {self.kind}, heading {heading}, map {self.step}: "
            f"{verdict}{place}; alignment: {aligned}"
        )


@dataclass(frozen=True, eq=False)
class Try:
    """An outcome, with what led to it."""

    outcome: Outcome
    view: View
    belief: Belief


def tried(seed: int, heaps: int, maps: Path, number: int) -> list[Outcome]:
    """What becomes of one case, in a process of its own; `maps` is the folder of the flights'."""
    return list(outcomes(seed, [number], _flown(heaps, maps), Config()))


@cache
def _flown(heaps: int, maps: Path) -> list[Flown]:
    return flights(heaps, maps)


def outcomes(
    seed: int, numbers: Iterable[int], flown: Sequence[Flown], config: Config
) -> Iterator[Outcome]:
    """What becomes of each aerial map of each case, where the heading is known or searched."""
    for one in tries(seed, numbers, flown, config):
        yield one.outcome


def tries(
    seed: int, numbers: Iterable[int], flown: Sequence[Flown], config: Config
) -> Iterator[Try]:
    """The same, with what led to it."""
    for number in numbers:
        rng = np.random.default_rng([seed, number])
        kind = ORDER[number % len(ORDER)]
        searched = number // len(ORDER) % SEARCHED == SEARCHED - 1
        views = KINDS[kind](flown, rng, MAPS)
        heading = "search" if searched else "known"
        yield from _try(number, kind, views, with_localization(config, heading=heading), rng)


def _try(
    number: int, kind: str, views: Sequence[View], config: Config, rng: np.random.Generator
) -> Iterator[Try]:
    localizer = MonteCarloLocalizer(config, rng)
    for step, view in enumerate(views, 1):
        pair = HeightMapPair(
            step, view.aerial, view.camera, view.ground, view.robot, view.heading, config
        )
        for _ in localizer.update(pair):
            pass
        belief = localizer.belief
        assert belief is not None
        located = _error(view, belief.T_ground_mav)
        alignment = None
        if belief.converged or step == len(views):
            aerial, ground = _cloud(view.aerial), _cloud(view.ground)
            alignment = refine(step, belief.T_ground_mav, aerial, ground, config)
        accepted = alignment is not None and alignment.accepted
        outcome = Outcome(
            number=number,
            step=step,
            kind=kind,
            searched=config.localization.heading == "search",
            claimed=belief.converged,
            claimed_wrongly=belief.converged and not located.horizontal_m <= LOCATED_M,
            aligned=alignment is not None,
            accepted=accepted,
            accepted_wrongly=accepted and not _is_good(view, alignment),
            refusals=(belief.refusal, "" if alignment is None else alignment.refusal),
            off_m=located.horizontal_m,
        )
        yield Try(outcome, view, belief)


def _is_good(view: View, alignment: Alignment | None) -> bool:
    assert alignment is not None
    error = _error(view, alignment.T_ground_mav)
    return bool(is_good_pose(error.translation_m, error.rotation_deg))


def _error(view: View, T_ground_mav: SE3) -> PoseError:
    """NaN where there is no right motion."""
    if view.T_ground_mav is None:
        return PoseError(float("nan"), float("nan"), float("nan"))
    camera = SE3(np.eye(3), view.camera)
    return relative_error(T_ground_mav, view.T_ground_mav, camera)


def _cloud(points: Points) -> PointCloud:
    return PointCloud(points, np.zeros((len(points), 3), np.uint8))


def table(found: Sequence[Outcome]) -> str:
    """Counts by kind and by heading, as Markdown."""
    columns = "aerial maps", "claims", "wrong", "aligned", "wrong", "from refused guesses", "wrong"
    lines = [f"| case | {' | '.join(columns)} |", "|---" * (1 + len(columns)) + "|"]
    negatives = [one for one in found if one.kind in NEGATIVES]
    groups = {kind: [one for one in found if one.kind == kind] for kind in NEGATIVES}
    groups["all without a place"] = negatives
    groups["of these, heading known"] = [one for one in negatives if not one.searched]
    groups["of these, heading searched"] = [one for one in negatives if one.searched]
    groups |= {kind: [one for one in found if one.kind == kind] for kind in PLACES}
    lines += [f"| {name} | {_counts(group)} |" for name, group in groups.items() if group]
    return "\n".join(lines)


def _counts(group: Sequence[Outcome]) -> str:
    """Of claims, of alignments after a claim, and of alignments from a refused best guess."""
    claimed = [one for one in group if one.claimed]
    guessed = [one for one in group if one.aligned and not one.claimed]
    return " | ".join(
        [
            str(len(group)),
            str(len(claimed)),
            _share(sum(one.claimed_wrongly for one in group), len(group)),
            str(sum(one.accepted for one in claimed)),
            _share(sum(one.accepted_wrongly for one in claimed), len(group)),
            f"{sum(one.accepted for one in guessed)} of {len(guessed)}",
            str(sum(one.accepted_wrongly for one in guessed)),
        ]
    )


def _share(count: int, total: int) -> str:
    """Count, and the 95 % interval of its share of all aerial maps."""
    rate = wilson(count, total)
    return f"{count} [{100 * rate.low:.2f}, {100 * rate.high:.2f}] %"
