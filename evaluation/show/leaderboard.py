"""Scores on the screen, as files, and several submissions ranked on one page."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from airground import __version__
from evaluation.judge.score.parts import Leaderboard, ScoreFile, SubmissionScore
from evaluation.judge.score.scoring import REACH_M
from evaluation.setup.level_mark import LevelMark
from evaluation.setup.text import TextTable, formatted, percent, print_table
from evaluation.show.figures.style import COLUMN_IN, SERIES, ReportFigure, styled
from evaluation.show.report.page import rendered, saved_picture

PAGE, JSON, SCORE = "leaderboard.html", "leaderboard.json", "score.json"
HEADER = (
    "", "submission", "score", "in 0.25 m", "area", "points", "wrong", "claims, wrong",
)  # fmt: skip
_AT_25_CM = 2
"""Index of 0.25 m among `DISTANCES_M`."""
MOST_CURVES = len(SERIES)
"""More would have no colour of their own: the best ones are drawn."""


def score_table(board: Leaderboard) -> TextTable:
    """One row per submission, the best first."""
    rows = []
    for entry in board.entries:
        spread = "" if entry.score_spread is None else f" ± {entry.score_spread:.1f}"
        right = None if entry.right is None else entry.right[_AT_25_CM]
        details = [
            entry.by,
            f"{entry.runs} runs" if entry.runs > 1 else "",
            f"{max(entry.missing)} without a file" if any(entry.missing) else "",
        ]
        rows.append(
            (
                str(entry.rank),
                "\n".join([entry.name, ", ".join(filter(None, details))]).strip(),
                f"{entry.score:.1f}{spread}",
                percent(right),
                formatted(entry.area, "{:.3f}"),
                formatted(entry.points, "{:.1f}"),
                percent(entry.wrong),
                f"{sum(entry.claims)}, {sum(entry.wrong_claims)}",
            )
        )
    return TextTable(HEADER, tuple(rows))


def print_scores(board: Leaderboard) -> None:
    """Print the table."""
    level = "" if board.level is None else f", level {board.level}"
    print_table(
        score_table(board),
        f"{board.recordings} recordings, {board.with_place} with something to find{level}",
        "score: 100 (area - wrong); seconds are judged (docs/score.md)",
        left=(0, 1),
        bold=(2,),
        compact=True,
    )


def write_scores(folder: Path, scores: Sequence[SubmissionScore], board: Leaderboard) -> None:
    """Write `NAME/score.json` of each submission, `leaderboard.json` and the page."""
    for number, score in enumerate(scores, start=1):
        name = re.sub(r"[^\w.-]+", "_", score.name).strip(".") or str(number)
        own = folder / name
        if own.exists():
            own = folder / f"{name}_{number}"
        own.mkdir()
        written = ScoreFile(
            schema="airground-score",
            airground=__version__,
            level=board.level,
            submission=score,
        )
        _write(own / SCORE, written.model_dump_json(by_alias=True, indent=1))
    _write(folder / JSON, board.model_dump_json(by_alias=True, indent=1))
    page = rendered(
        "leaderboard.html.j2",
        level=board.level,
        recordings=board.recordings,
        with_place=board.with_place,
        table=score_table(board),
        pictures=[saved_picture(curves(scores, board.level), folder)] if board.with_place else [],
        version=__version__,
    )
    (folder / PAGE).write_text(page, encoding="utf-8")


def _write(path: Path, text: str) -> None:
    path.write_text(text + "\n", encoding="utf-8")


@styled
def curves(scores: Sequence[SubmissionScore], level: LevelMark | None) -> ReportFigure:
    """Share of the recordings with an error up to a distance, for the best submissions."""
    figure = Figure(figsize=(COLUMN_IN, 2.6), layout="constrained")
    axes = figure.subplots()
    best = sorted(scores, key=lambda one: (-one.score, one.name))[:MOST_CURVES]
    distances = np.linspace(0, REACH_M, 401)
    for score, colour in zip(best, SERIES, strict=False):
        errors = [
            np.inf if one.error_m is None else one.error_m
            for run in score.runs
            for one in run.sequences
            if one.has_place
        ]
        shares = (np.array(errors)[:, None] <= distances).mean(axis=0)
        axes.step(distances, 100 * shares, where="post", color=colour, label=score.name)
    axes.set(xlim=(0, REACH_M), ylim=(0, 103), xlabel="error [m]", ylabel="recordings [%]")
    axes.legend(loc="lower right")
    where = "" if level is None else f" Level {level}."
    caption = (
        "Recordings whose median error over the second half of the flight is at most so large; "
        f"several runs together.{where} The area under a curve is what the score counts."
    )
    return ReportFigure("curves", "Right within a distance", caption, figure, wide=False)
