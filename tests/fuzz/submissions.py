"""Submissions to a benchmark, and the truth that they are scored against."""

from __future__ import annotations

import shutil
from pathlib import Path

from evaluation.judge.score.benchmark import Benchmark, read_benchmark, recordings_in
from evaluation.judge.score.parts import Leaderboard
from evaluation.judge.score.scoring import Task, score_submission
from evaluation.judge.score.submission import read_submission
from evaluation.setup.level_mark import LevelMark
from evaluation.show.leaderboard import write_scores
from tests.fuzz.folders import make_recording

NAMES = ("0001", "0002")


def make_submission(folder: Path) -> None:
    """Answers of two runs to a benchmark, and what it was made from."""
    lines = [f"{n / 100:.9f} {n / 100} 0 0 0 0 0 1 {n % 2}" for n in range(2, 18)]
    for name in ("run1/0001.tum", "run2/0001.txt"):
        (folder / "submission" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "submission" / name).write_text("\n".join(["# answers", *lines]) + "\n")
    commas = "\n".join(line.replace(" ", ",") for line in lines) + "\n"
    (folder / "submission" / "run2" / "0002.csv").write_text(commas)
    (folder / "submission" / "submission.toml").write_text('name = "Ours"\nby = "a group"\n')
    truth, made = folder / "truth", folder / "made"
    made.mkdir()
    make_recording(made)
    for name in NAMES:
        (truth / name).mkdir(parents=True)
        shutil.copyfile(made / "recording" / "recording.toml", truth / name / "recording.toml")
        shutil.copytree(made / "recording" / "truth", truth / name / "truth")
    shutil.rmtree(made)
    level = LevelMark(name="hard", version=1)
    Benchmark(schema=1, level=level, seed=1, recordings=NAMES).write(truth)


def read_scored(folder: Path, out: Path) -> object:
    """As `score` reads them."""
    benchmark = read_benchmark(folder / "truth")
    tasks = [Task.open(one) for one in recordings_in(folder / "truth")]
    submission = read_submission(folder / "submission", {task.name for task in tasks})
    sizes = [(task.name, task.seconds, task.last_s, task.has_place) for task in tasks]
    return benchmark, sizes, submission


def work_on_scored(folder: Path, out: Path) -> None:
    """As `score`."""
    benchmark = read_benchmark(folder / "truth")
    tasks = [Task.open(one) for one in recordings_in(folder / "truth")]
    submission = read_submission(folder / "submission", {task.name for task in tasks})
    scores = [score_submission(submission, tasks)]
    board = Leaderboard.of(scores, None if benchmark is None else benchmark.level, "0.1.0")
    write_scores(out, scores, board)
