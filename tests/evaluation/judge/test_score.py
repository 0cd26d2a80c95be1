"""Scores of submissions, in closed form."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import AirgroundError, InputError
from evaluation.judge.score.parts import (
    DISTANCES_M,
    Leaderboard,
    RunScore,
    SequenceScore,
    SubmissionScore,
)
from evaluation.judge.score.scoring import Task, score_run, score_sequence, score_submission
from evaluation.judge.score.submission import About, Submission, read_submission
from evaluation.show.leaderboard import print_scores, write_scores
from evaluation.table.answer_file import Answers, read_answers, write_answers
from evaluation.table.truth_errors import pose_error
from sim.recording.truth import Truth

SECOND = 1_000_000_000
DURATION_S, SECONDS = 20.0, 19
TENTHS = range(SECOND // 10, int(19.9 * SECOND), SECOND // 10)


class Circling:
    """A truth: the ground robot drives and turns, the MAV circles above it."""

    def T_world_ground_camera(self, stamp_ns: int) -> SE3:
        t = stamp_ns / SECOND
        return SE3(turn([-1.6, 0.1 * t, 0.0]).rotation, np.array([0.1 * t, 0.0, 0.6]))

    def T_world_mav_camera(self, stamp_ns: int) -> SE3:
        t = stamp_ns / SECOND
        return SE3(
            turn([3.0, 0.0, 0.2 * t]).rotation, np.array([np.cos(0.3 * t), np.sin(0.3 * t), 2.2])
        )


TRUTH = cast(Truth, Circling())
OFF_M = np.array([0.1, 0.2, 0.2])
"""A direction in space, 0.3 m long."""


def turn(vector: list[float]) -> SE3:
    return SE3.from_rotation_vector(np.array(vector))


def task(name: str = "0001", has_place: bool = True) -> Task:
    return Task(name, TRUTH, SECONDS, DURATION_S, has_place)


def relative(stamp_ns: int) -> SE3:
    return TRUTH.T_world_ground_camera(stamp_ns).inverse() @ TRUTH.T_world_mav_camera(stamp_ns)


def answers(
    off_m: float = 0.0,
    angle_deg: float = 0.0,
    stamps_ns: range | list[int] = TENTHS,
    claimed: Callable[[int], bool] = lambda _: True,
) -> Answers:
    """The truth with an error in space, at some stamps."""
    turned = turn([0.0, np.deg2rad(angle_deg), 0.0])
    poses = []
    for stamp in stamps_ns:
        true = relative(stamp)
        moved = SE3(true.rotation, true.translation + off_m / 0.3 * OFF_M)
        poses.append(moved @ turned)
    flags = np.array([claimed(stamp) for stamp in stamps_ns])
    return Answers(Trajectory.from_poses(list(stamps_ns), poses), flags)


def of(given: Answers | None, has_place: bool = True) -> SequenceScore:
    return score_sequence(task(has_place=has_place), given)


def total(given: Answers | None) -> float:
    return score_run({} if given is None else {"0001": given}, [task()]).score


def test_perfect_poses_earn_all() -> None:
    made = of(answers())
    assert made.error_m == pytest.approx(0, abs=1e-9)
    assert (made.area, made.points) == (pytest.approx(1), 100)
    assert (made.seconds, made.claimed, made.wrong) == (SECONDS, SECONDS, 0)
    assert made.right == [True] * len(DISTANCES_M)
    assert total(answers()) == pytest.approx(100)


@pytest.mark.parametrize(
    ("off_m", "points", "right", "wrong"),
    [
        (0.04, 100, [True] * 5, 0),
        (0.07, 60, [False, True, True, True, True], 0),
        (0.2, 30, [False, False, True, True, True], 0),
        (0.3, 10, [False, False, False, True, True], SECONDS),
        (0.9, 0, [False, False, False, False, True], SECONDS),
    ],
)
def test_an_error_takes_its_area_and_beyond_a_limit_the_claims(
    off_m: float, points: float, right: list[bool], wrong: int
) -> None:
    made = of(answers(off_m))
    assert made.error_m == pytest.approx(off_m)
    assert made.area == pytest.approx(1 - off_m)
    assert (made.points, made.right, made.wrong) == (pytest.approx(points), right, wrong)
    assert total(answers(off_m)) == pytest.approx(100 * (1 - off_m - (wrong > 0)))


def test_a_pose_turned_too_far_is_wrong_wherever_it_is() -> None:
    assert of(answers(angle_deg=2.9)).area == pytest.approx(1)
    made = of(answers(angle_deg=3.1))
    assert (made.error_m, made.area, made.points, made.wrong) == (None, 0, 0, SECONDS)
    assert total(answers(angle_deg=3.1)) == pytest.approx(-100)


def test_claiming_nothing_earns_nothing_and_costs_nothing() -> None:
    for given in (None, answers(off_m=5, claimed=lambda _: False)):
        made = of(given)
        assert (made.claimed, made.wrong, made.error_m, made.area) == (0, 0, None, 0)
        assert total(given) == 0
    assert score_run({}, [task("0001"), task("0002")]).missing == 2


def test_where_nothing_is_to_be_found_every_claim_is_wrong() -> None:
    assert of(answers(), has_place=False).wrong == SECONDS
    silent = of(None, has_place=False)
    assert (silent.wrong, silent.area, silent.points, silent.right) == (0, None, None, None)
    placed, empty = task("a"), task("b", has_place=False)
    quiet = score_run({"a": answers()}, [placed, empty])
    assert (quiet.score, quiet.area) == (pytest.approx(100), pytest.approx(1))
    loud = score_run({"a": answers(), "b": answers()}, [placed, empty])
    assert loud.score == pytest.approx(50)


def test_the_first_half_is_for_finding_the_place() -> None:
    found_late = answers(claimed=lambda stamp: stamp >= 9.5 * SECOND)
    assert total(found_late) == pytest.approx(100)


def test_half_of_the_second_half_makes_a_sequence_right() -> None:
    # Of seconds 10 to 19, five with a claim are half of them; four are not.
    assert of(answers(claimed=lambda stamp: stamp > 14.5 * SECOND)).area == pytest.approx(1)
    assert of(answers(claimed=lambda stamp: stamp > 15.5 * SECOND)).area == 0


def test_a_wrong_claim_between_right_ones_counts() -> None:
    good, bad = answers(), answers(off_m=2)
    stamps = list(TENTHS)
    at = stamps.index(int(15.3 * SECOND))
    poses = [(bad if i == at else good).poses[i] for i in range(len(stamps))]
    made = of(Answers(Trajectory.from_poses(stamps, poses), good.claimed))
    assert (made.wrong, made.area) == (1, pytest.approx(1))


def test_the_rate_of_the_poses_does_not_matter() -> None:
    each_second = [number * SECOND for number in range(1, SECONDS + 1)]
    for off_m in (0.0, 0.3):
        assert of(answers(off_m, stamps_ns=each_second)) == of(answers(off_m))


def test_poses_outside_the_recording_are_rejected() -> None:
    for stamps in ([20 * SECOND], [1_400_000_000 * SECOND], [0]):
        with pytest.raises(InputError, match=r"0001: poses from .* the recording has images from"):
            of(answers(stamps_ns=stamps))


def test_the_error_is_that_of_the_evaluator() -> None:
    """Of the MAV's camera relative to the ground robot's, in space; no gauge has any effect."""
    stamp = 12 * SECOND
    T_mav_world = SE3(turn([0.0, 0.0, 1.0]).rotation, np.array([3.0, -2.0, 0.4]))
    T_ground_world = SE3(turn([0.0, 0.0, -0.7]).rotation, np.array([-1.0, 5.0, 0.1]))

    @dataclass(frozen=True)
    class Poses:
        mav_stamp_ns: int = stamp
        T_mav_camera: SE3 = T_mav_world @ TRUTH.T_world_mav_camera(stamp)
        ground_stamp_ns: int = stamp
        T_ground_camera: SE3 = T_ground_world @ TRUTH.T_world_ground_camera(stamp)

    poses = Poses()
    off = SE3(turn([0.01, 0.0, 0.02]).rotation, np.array([0.1, 0.05, 0.02]))
    T_ground_mav = off @ T_ground_world @ T_mav_world.inverse()
    expected = pose_error(T_ground_mav, poses, TRUTH)
    claimed = poses.T_ground_camera.inverse() @ T_ground_mav @ poses.T_mav_camera
    given = Answers(Trajectory.from_poses([stamp], [claimed]), np.array([True]))
    made = score_sequence(Task("0001", TRUTH, 1, DURATION_S, True), given)
    assert made.error_m == pytest.approx(expected.translation_m)


def submission(name: str, *runs: Answers) -> Submission:
    return Submission(name, About(), [{"0001": run} for run in runs])


def test_several_runs_are_averaged_with_their_spread() -> None:
    made = score_submission(submission("dice", answers(0.09), answers(0.2)), [task()])
    assert made.score == pytest.approx(85.5)
    assert made.score_spread == pytest.approx(np.std([91, 80], ddof=1))
    assert score_submission(submission("one", answers(0.1)), [task()]).score_spread is None
    assert made.right() == [0, 0.5, 1, 1, 1]


def test_the_leaderboard_ranks_by_score_and_its_page_stands_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tasks = [task(), task("flat", has_place=False)]
    scores = [
        score_submission(submission(name, answers(off)), tasks)
        for name, off in (("late", 0.2), ("<b>near</b>", 0.1), ("also late", 0.2))
    ]
    board = Leaderboard.of(scores, None, "0.1.0")
    assert [(one.rank, one.name) for one in board.entries] == [
        (1, "<b>near</b>"), (2, "also late"), (2, "late"),
    ]  # fmt: skip
    write_scores(tmp_path, scores, board)
    page = (tmp_path / "leaderboard.html").read_text()
    assert "&lt;b&gt;near&lt;/b&gt;" in page
    assert "<b>near</b>" not in page
    read = Leaderboard.model_validate_json((tmp_path / "leaderboard.json").read_text())
    assert read == board
    assert (read.recordings, read.with_place, read.entries[0].missing) == (2, 1, [1])
    names = sorted(path.parent.name for path in tmp_path.glob("*/score.json"))
    assert names == ["_b_near_b_", "also_late", "late"]
    own = json.loads((tmp_path / "late" / "score.json").read_text())
    assert SubmissionScore.model_validate(own["submission"]) == scores[0]
    print_scores(board)
    assert "2 recordings, 1 with something to find" in capsys.readouterr().out


def test_a_benchmark_of_nothing_to_find_has_no_area() -> None:
    made = RunScore.of([of(answers(), has_place=False)])
    assert (made.score, made.area, made.right) == (pytest.approx(-100), None, None)


def test_a_pipe_is_no_file_of_poses(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "0001.tum")
    with pytest.raises(AirgroundError, match="is a pipe"):
        read_submission(tmp_path, {"0001"})


ROW = "1.5 0 0 2 0 0 0 1"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1.5 0 0 nan 0 0 0 1", "is not finite"),
        ("1.5 0 0 1e30 0 0 0 1", "beyond"),
        ("1.5 0 0 2 0 0 0 2", "length 1"),
        (f"{ROW} 2", "claim must be 0 or 1"),
        (f"{ROW} 1 1", "got 10 fields"),
        ("1.5 0 0", "got 3 fields"),
        (f"{ROW}\n{ROW}", "must strictly increase"),
        ("nan 0 0 2 0 0 0 1", "no time in seconds"),
        ("1400000000000000000 0 0 2 0 0 0 1", "looks like nanoseconds"),
        ("# nothing", "holds no pose"),
    ],
)
def test_wrong_lines_are_answered_in_one_line(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "0001.tum").write_text(f"{text}\n")
    with pytest.raises(AirgroundError, match=message) as refusal:
        read_answers(tmp_path / "0001.tum")
    assert "\n" not in str(refusal.value)


def test_files_say_the_same_with_spaces_and_with_commas(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(
        "# stamp, ...\n1.5, 0, 0, 2, 0, 0, 0, 1, 0\n2,1,0,2,0,0,0,1,1\n"
    )
    (tmp_path / "a.tum").write_text(f"{ROW} 0\n2 1 0 2 0 0 0 1\n")
    first, second = (read_answers(tmp_path / name) for name in ("a.csv", "a.tum"))
    assert first.claimed.tolist() == second.claimed.tolist() == [False, True]
    assert [stamp for stamp, _ in first.claims()] == [2 * SECOND]
    np.testing.assert_array_equal(first.poses.translations, second.poses.translations)
    write_answers(tmp_path / "b.tum", answers(0.1).claims())
    again = read_answers(tmp_path / "b.tum")
    assert of(again).error_m == pytest.approx(0.1, abs=1e-6)


def write(folder: Path, *names: str) -> Path:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(ROW + "\n")
    return folder


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (("0009.tum",), "0009.tum: is named like no recording; these are 0001, 0002"),
        (("0001.tum", "0001.txt"), "another file of recording 0001"),
        (("0001.tum", "run1/0001.tum"), "holds runs and files"),
        (("README.md",), "holds no file of poses"),
    ],
)
def test_wrong_folders_are_answered_in_one_line(
    names: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    write(tmp_path / "mine", *names)
    with pytest.raises(InputError, match=message):
        read_submission(tmp_path / "mine", {"0001", "0002"})


def test_runs_are_read_in_order_and_may_miss_recordings(tmp_path: Path) -> None:
    folder = write(tmp_path / "mine", "run10/0001.tum", "run2/0001.tum", "run2/0002.txt", "LICENSE")
    read = read_submission(folder, {"0001", "0002"})
    assert (read.name, [sorted(run) for run in read.runs]) == ("mine", [["0001", "0002"], ["0001"]])


def test_a_submission_states_its_name(tmp_path: Path) -> None:
    folder = write(tmp_path / "mine", "0001.tum")
    (folder / "submission.toml").write_text('name = "Ours"\nby = "a group"\n')
    assert read_submission(folder, {"0001"}).name == "Ours"
    (folder / "submission.toml").write_text('name = "Ours"\nrank = 1\n')
    with pytest.raises(InputError, match=r"submission.toml: rank"):
        read_submission(folder, {"0001"})
    (folder / "submission.toml").write_text('name = "two\\nlines"\n')
    with pytest.raises(InputError, match=r"submission.toml: name"):
        read_submission(folder, {"0001"})
