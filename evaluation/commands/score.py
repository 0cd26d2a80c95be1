"""`airground submit` and `score`: answers to a benchmark, and what they are worth."""

from __future__ import annotations

import shutil
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import Positional

from airground.errors import InputError
from evaluation.commands.options import OutOption, Shown, Verb

if TYPE_CHECKING:
    from evaluation.setup.level_mark import LevelMark


@dataclass(frozen=True, kw_only=True)
class Submit(OutOption, Verb):
    """Collect the claims of runs as a submission to score.

    Every run is a folder of run, with the name of its recording. A run that claimed nothing is
    left out, which scores the same, and so is a baseline that claimed nothing in any run.
    """

    runs: Annotated[Positional[tuple[Path, ...]], Shown("RUN ...")]
    """folders that run has written, each named like its recording"""
    baselines: bool = False
    """a submission of each baseline that run --baselines had answer, in a folder of its name"""

    def main(self) -> None:
        from evaluation.setup.output import fresh_folder

        self._check_runs()
        claimed = {run: self._files(run) for run in self.runs}
        if not any(claimed.values()):
            raise InputError(
                f"{self.runs[0]}: has no {self._pattern}; nothing was claimed in any run"
            )
        made: Counter[Path] = Counter()
        with fresh_folder(self.out) as folder:
            for run, files in claimed.items():
                for file in files:
                    part = Path(file.stem if self.baselines else "")
                    (folder / part).mkdir(exist_ok=True)
                    shutil.copyfile(file, folder / part / f"{run.resolve().name}.tum")
                    made[self.out / part] += 1
        for submission, count in sorted(made.items()):
            print(f"{submission}: {count} of {len(self.runs)} runs claimed something")

    @property
    def _pattern(self) -> str:
        """What a run leaves of what is asked for."""
        from evaluation.run.claim_log import BASELINE_CLAIMS, CLAIMS

        return f"{BASELINE_CLAIMS}/*.tum" if self.baselines else CLAIMS

    def _files(self, run: Path) -> list[Path]:
        return sorted(file for file in run.glob(self._pattern) if file.is_file())

    def _check_runs(self) -> None:
        """Raises InputError where a folder is no run, or two have one name."""
        if not self.runs:
            raise InputError("no RUN given: name at least one folder of run")
        names = Counter(run.resolve().name for run in self.runs)
        twice = [name for name, count in names.items() if count > 1]
        if twice:
            raise InputError(f"{twice[0]}: two runs of this name; a submission has one each")
        for run in self.runs:
            if not run.is_dir():
                raise InputError(f"{run}: no such folder; expected what run wrote")
            needed = (run / self._pattern).parent
            if not needed.is_dir():
                raise InputError(
                    f"{run}: has no {needed.name}; expected what run --baselines wrote"
                )


@dataclass(frozen=True, kw_only=True)
class Score(Verb):
    """Score submissions against the truth that simulate --sealed has put aside.

    A submission is a folder with one file of poses per recording, or with folders run1, run2, ...
    of such files (docs/score.md). Several are ranked.
    """

    submissions: Annotated[Positional[tuple[Path, ...]], Shown("SUBMISSION ...")]
    """folders of answers, as submit writes them"""
    truth: Annotated[Path, Shown("DIR")]
    """folder of simulate --sealed, or of recordings that hold their truth"""
    level: Annotated[
        Literal["paper", "easy", "medium", "hard", "extreme"] | None, Shown("NAME")
    ] = None
    """reject a truth that is not of this level"""
    out: Annotated[Path | None, Shown("DIR", "the screen only")] = None
    """folder to make, for score.json of each, leaderboard.json and leaderboard.html"""

    def main(self) -> None:
        from airground import __version__
        from evaluation.judge.score.benchmark import recordings_in
        from evaluation.judge.score.parts import Leaderboard
        from evaluation.judge.score.scoring import Task, score_submission
        from evaluation.judge.score.submission import read_submission
        from evaluation.setup.output import check_free, fresh_folder
        from evaluation.setup.progress import step
        from evaluation.show.leaderboard import print_scores, write_scores

        if not self.submissions:
            raise InputError("no SUBMISSION given: name at least one folder of answers")
        if self.out is not None:
            check_free(self.out)
        level = self._level()
        tasks = [Task.open(folder) for folder in recordings_in(self.truth)]
        names = {task.name for task in tasks}
        read = [read_submission(folder, names) for folder in self.submissions]
        twice = [name for name, count in Counter(one.name for one in read).items() if count > 1]
        if twice:
            raise InputError(f"{twice[0]}: two submissions of this name")
        with step("scoring"):
            scores = [score_submission(one, tasks) for one in read]
        board = Leaderboard.of(scores, level, __version__)
        if self.out is not None:
            with fresh_folder(self.out) as folder:
                write_scores(folder, scores, board)
        print_scores(board)

    def _level(self) -> LevelMark | None:
        """The level of the truth.

        Raises:
            InputError: Another one was asked for.
        """
        from evaluation.judge.score.benchmark import read_benchmark
        from evaluation.measure.levels.level import load_level

        benchmark = read_benchmark(self.truth)
        level = None if benchmark is None else benchmark.level
        if self.level is not None and level != load_level(self.level).mark:
            stated = "no level" if level is None else f"level {level}"
            raise InputError(
                f"{self.truth}: states {stated}; expected {load_level(self.level).mark}"
            )
        return level
