"""The score of a submission: how many sequences are right, and how much was claimed wrongly.

A pose is judged as everywhere in this project: the MAV's camera relative to the ground robot's
camera at the same time, without any alignment. `docs/score.md` has the formulas.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.errors import InputError
from airground.io.header import read_header
from airground.io.layout import HEADER
from evaluation.judge.score.parts import DISTANCES_M, RunScore, SequenceScore, SubmissionScore
from evaluation.judge.score.submission import Submission
from evaluation.table.answer_file import Answers
from evaluation.table.limits import LOCATED_M
from evaluation.table.rows import CONTROL_SCENES
from sim.recording.truth import Truth

REACH_M = 1.0
"""Largest error that earns anything: the end of the curve whose area is scored [m]."""
TURN_DEG = 3.0
"""A pose turned by more is not right, wherever it is: the noise of the paper's starts [deg]."""
POINTS = ((0.05, 10), (0.10, 6), (0.25, 3), (0.50, 1))
"""Points of a second with an error up to a distance [m]: a good refinement earns all."""
SECOND_NS = 1_000_000_000


@dataclass(frozen=True, eq=False)
class Task:
    """One recording of a benchmark, with its truth.

    Attributes:
        name: Name of the recording.
        truth: True motion and calibration.
        seconds: Number of whole seconds to judge, 1, 2, ...
        last_s: End of the recording [s].
        has_place: Whether there is anything to find; else every claim is wrong.
    """

    name: str
    truth: Truth
    seconds: int
    last_s: float
    has_place: bool

    @classmethod
    def open(cls, folder: Path) -> Task:
        """From `NAME/recording.toml` and `NAME/truth/`.

        Raises:
            AirgroundError: A file is missing or damaged.
        """
        header, truth = read_header(folder / HEADER), Truth.open(folder)
        last_s = min(header.duration_s, float(truth.motion.stamps_ns[-1]) * 1e-9)
        seconds = max(1, math.floor(last_s - 0.5))
        return cls(folder.name, truth, seconds, last_s, header.scene not in CONTROL_SCENES)


def score_submission(submission: Submission, tasks: Sequence[Task]) -> SubmissionScore:
    """Score every run.

    Raises:
        InputError: A pose is outside the time of its recording.
    """
    runs = [score_run(answers, tasks) for answers in submission.runs]
    return SubmissionScore.of(submission.name, submission.about.by, runs)


def score_run(answers: Mapping[str, Answers], tasks: Sequence[Task]) -> RunScore:
    """Score the answers of one run; a recording without answers claims nothing."""
    return RunScore.of([score_sequence(task, answers.get(task.name)) for task in tasks])


def score_sequence(task: Task, answers: Answers | None) -> SequenceScore:
    """Score the answers to one recording."""
    claims = [] if answers is None else answers.claims()
    if answers is not None:
        _check_times(task, answers)
    errors = [_error(task.truth, stamp, pose) for stamp, pose in claims]
    second = [_second(stamp, task.seconds) for stamp, _ in claims]
    off_m = np.full(task.seconds, np.inf)  # of the claim nearest to each whole second
    nearest = np.full(task.seconds, np.inf)
    claimed, wrong = np.zeros(task.seconds, bool), np.zeros(task.seconds, bool)
    for (stamp, _), index, (distance_m, angle_deg) in zip(claims, second, errors, strict=True):
        turned = angle_deg > TURN_DEG
        claimed[index] = True
        wrong[index] |= turned or distance_m > LOCATED_M or not task.has_place
        beside_s = abs(stamp / SECOND_NS - (index + 1))
        if beside_s < nearest[index]:
            nearest[index], off_m[index] = beside_s, np.inf if turned else distance_m
    # The first half is for finding the place.
    judged = off_m[task.seconds // 2 :]
    middle = float(np.sort(judged)[(len(judged) - 1) // 2])
    return SequenceScore(
        name=task.name,
        answered=answers is not None,
        has_place=task.has_place,
        seconds=task.seconds,
        claimed=int(claimed.sum()),
        wrong=int(wrong.sum()),
        error_m=middle if task.has_place and np.isfinite(middle) else None,
        area=max(0.0, 1 - middle / REACH_M) if task.has_place else None,
        points=_points(judged) if task.has_place else None,
        right=[bool(middle <= distance) for distance in DISTANCES_M] if task.has_place else None,
    )


def _points(errors_m: NDArray[np.float64]) -> float:
    """Mean points of the judged seconds, of 100."""
    earned = [
        next((points for limit, points in POINTS if error <= limit), 0)
        for error in errors_m.tolist()
    ]
    return 10 * float(np.mean(earned))


def _error(truth: Truth, stamp_ns: int, pose: SE3) -> tuple[float, float]:
    """Distance in space [m] and angle [deg] between a claimed pose and the true one."""
    T_world_ground = truth.T_world_ground_camera(stamp_ns)
    true = T_world_ground.inverse() @ truth.T_world_mav_camera(stamp_ns)
    off_m = float(np.linalg.norm(pose.translation - true.translation))
    return off_m, float(np.rad2deg((true.inverse() @ pose).angle()))


def _second(stamp_ns: int, seconds: int) -> int:
    """Index of the nearest whole second, of 1 to `seconds`."""
    nearest = math.floor(stamp_ns / SECOND_NS + 0.5)
    return min(max(nearest, 1), seconds) - 1


def _check_times(task: Task, answers: Answers) -> None:
    """All answers lie in the recording, a little less for the clock of the camera."""
    first, last = (float(answers.poses.stamps_ns[end]) / SECOND_NS for end in (0, -1))
    margin_s = 0.01
    if first < margin_s or last > task.last_s - margin_s:
        raise InputError(
            f"{task.name}: poses from {first:.3f} to {last:.3f} s; the recording has images from "
            f"0.050 to {task.last_s - 2 * margin_s:.3f} s, and stamps are those of the MAV's images"
        )
