"""`score.json` and `leaderboard.json`: scores of sequences, runs and submissions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from evaluation.setup.checked_json import Amount, Count, Number, Part, Share
from evaluation.setup.level_mark import LevelMark

DISTANCES_M = (0.05, 0.10, 0.25, 0.50, 1.00)
"""Distances at which shares of right sequences are stated [m]; the second last and third are those
of the paper."""
Points = Annotated[float, Field(ge=0, le=100)]
Signed = Annotated[float, Field(allow_inf_nan=False)]


class SequenceScore(Part):
    """One recording.

    Attributes:
        name: Of the recording.
        answered: Whether there was a file.
        has_place: Whether there is anything to find.
        seconds, claimed, wrong: Number of seconds, of those with a claim, and of those with a
            wrong one.
        error_m: Median over the second half, a second without a claim or turned too far counting
            as infinite; null where it is infinite, and where there is nothing to find.
        area: 1 - error_m over 1 m, at least 0.
        points: Mean over the second half, of 100.
        right: Whether the error is within each of `DISTANCES_M`.
    """

    name: str
    answered: bool
    has_place: bool
    seconds: Count
    claimed: Count
    wrong: Count
    error_m: Number
    area: Share | None
    points: Points | None
    right: list[bool] | None


class RunScore(Part):
    """One run of a method over all recordings; means over the recordings, each counting alike.

    Attributes:
        score: 100 (area - wrong).
        area, points, right: Means over recordings with a place to find; null without any.
        wrong: Mean share of the seconds of a recording that have a wrong claim, over all.
        claims, wrong_claims: Number of seconds with a claim and with a wrong one, in all.
        missing: Number of recordings without a file.
        sequences: All recordings.
    """

    score: Signed
    area: Share | None
    points: Points | None
    right: list[Share] | None
    wrong: Share
    claims: Count
    wrong_claims: Count
    missing: Count
    sequences: list[SequenceScore]

    @classmethod
    def of(cls, sequences: Sequence[SequenceScore]) -> RunScore:
        placed = [one for one in sequences if one.has_place]
        area = float(np.mean([one.area for one in placed])) if placed else None
        wrong = float(np.mean([one.wrong / one.seconds for one in sequences]))
        right = np.array([one.right for one in placed], float)
        return cls(
            score=100 * ((area or 0.0) - wrong),
            area=area,
            points=float(np.mean([one.points for one in placed])) if placed else None,
            right=right.mean(axis=0).tolist() if placed else None,
            wrong=wrong,
            claims=sum(one.claimed for one in sequences),
            wrong_claims=sum(one.wrong for one in sequences),
            missing=sum(not one.answered for one in sequences),
            sequences=list(sequences),
        )


class SubmissionScore(Part):
    """A submission; `score_spread` is the standard deviation over its runs, null for one run."""

    name: str
    by: str
    score: Signed
    score_spread: Amount | None
    runs: Annotated[list[RunScore], Field(min_length=1)]

    @classmethod
    def of(cls, name: str, by: str, runs: Sequence[RunScore]) -> SubmissionScore:
        scores = np.array([run.score for run in runs])
        spread = float(scores.std(ddof=1)) if len(scores) > 1 else None
        return cls(
            name=name, by=by, score=float(scores.mean()), score_spread=spread, runs=list(runs)
        )

    def mean(self, key: Literal["area", "points", "wrong"]) -> float | None:
        """Mean over the runs; None where there is nothing to find."""
        values = [getattr(run, key) for run in self.runs]
        return None if None in values else float(np.mean(values))

    def right(self) -> list[float] | None:
        """Share of the sequences within each of `DISTANCES_M`, mean over the runs."""
        shares = [run.right for run in self.runs if run.right is not None]
        return np.mean(shares, axis=0).tolist() if shares else None


class ScoreFile(Part):
    """`score.json`: one submission, recording by recording; it shows which have nothing to find."""

    schema_: Literal["airground-score"] = Field(alias="schema")
    version: Literal[1] = 1
    airground: str
    level: LevelMark | None
    distances_m: tuple[float, ...] = DISTANCES_M
    submission: SubmissionScore


class Entry(Part):
    """A line of the leaderboard; means over the runs."""

    rank: Annotated[int, Field(ge=1)]
    name: str
    by: str
    runs: Annotated[int, Field(ge=1)]
    score: Signed
    score_spread: Amount | None
    area: Share | None
    right: list[Share] | None
    wrong: Share
    points: Points | None
    claims: list[Count]
    wrong_claims: list[Count]
    missing: list[Count]


class Leaderboard(Part):
    """`leaderboard.json`: sums only, which tell nothing of single recordings."""

    schema_: Literal["airground-leaderboard"] = Field(alias="schema")
    version: Literal[1] = 1
    airground: str
    level: LevelMark | None
    recordings: Count
    with_place: Count
    distances_m: tuple[float, ...] = DISTANCES_M
    entries: list[Entry]

    @classmethod
    def of(
        cls, scores: Sequence[SubmissionScore], level: LevelMark | None, airground: str
    ) -> Leaderboard:
        """Ranked by score; equal scores have the same rank."""
        ordered = sorted(scores, key=lambda one: (-one.score, one.name))
        values = [one.score for one in ordered]
        sequences = scores[0].runs[0].sequences
        return cls(
            schema="airground-leaderboard",
            airground=airground,
            level=level,
            recordings=len(sequences),
            with_place=sum(one.has_place for one in sequences),
            entries=[
                Entry(
                    rank=values.index(one.score) + 1,
                    name=one.name,
                    by=one.by,
                    runs=len(one.runs),
                    score=one.score,
                    score_spread=one.score_spread,
                    area=one.mean("area"),
                    right=one.right(),
                    wrong=one.mean("wrong") or 0.0,
                    points=one.mean("points"),
                    claims=[run.claims for run in one.runs],
                    wrong_claims=[run.wrong_claims for run in one.runs],
                    missing=[run.missing for run in one.runs],
                )
                for one in ordered
            ],
        )
