"""Sealed recordings: no truth in them, all of it beside them, and the verbs on both."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from airground.core.trajectory import Trajectory
from airground.errors import AirgroundError, InputError
from airground.io.header import read_header
from airground.io.layout import HEADER
from airground.io.recording import Recording
from evaluation.cli import answer
from evaluation.datasets.sealed import TRIES, Draw, make_benchmark, seal
from evaluation.judge.score.benchmark import BENCHMARK, read_benchmark, recordings_in
from evaluation.measure.levels.level import load_level
from evaluation.table.answer_file import Answers, write_answers
from sim.recording.recorder import Flight
from sim.recording.truth import Truth
from tests.sim.small_flight import SCENE


@pytest.fixture
def sealed(small: Path, tmp_path: Path) -> tuple[Path, Path]:
    """A recording without its truth, and the folder of the truths."""
    data, truth = tmp_path / "data" / "0001", tmp_path / "truth"
    shutil.copytree(small, data)
    truth.mkdir()
    seal(data, truth / "0001")
    return data, truth


def files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def test_nothing_in_a_sealed_recording_tells_the_truth(
    sealed: tuple[Path, Path], small: Path
) -> None:
    data, truth = sealed
    header, whole = read_header(data / HEADER), read_header(small / HEADER)
    assert (header.scene, header.seed, header.flight, header.dials) == ("sealed", 0, 0, None)
    assert whole.scene not in (data / HEADER).read_text()
    kept = {name for name in files(small) if not name.startswith("truth/")}
    assert files(data) == kept
    # What the sensors measured is the same, byte by byte.
    assert all(
        (data / name).read_bytes() == (small / name).read_bytes() for name in kept - {HEADER}
    )
    taken = {name for name in files(small) if name.startswith("truth/")}
    assert files(truth / "0001") == taken | {HEADER}
    assert (truth / "0001" / HEADER).read_bytes() == (small / HEADER).read_bytes()


def test_a_sealed_recording_opens_and_its_truth_is_beside_it(
    sealed: tuple[Path, Path], small: Path
) -> None:
    data, truth = sealed
    recording = Recording.open(data)
    recording.verify()
    stamp = int(recording.mav.camera_stamps[0])
    true, given = Truth.open(small), Truth.open(truth / "0001")
    assert true.T_world_mav_camera(stamp).translation.tolist() == (
        given.T_world_mav_camera(stamp).translation.tolist()
    )
    assert recordings_in(truth) == [truth / "0001"]


def test_verbs_that_need_truth_say_so_and_the_others_work(
    sealed: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, _ = sealed
    assert answer(["inspect", str(data)]) in (None, 0)
    out = str(tmp_path / "out")
    for words in (
        ["render", str(data), "--add", "depth"],
        ["export", str(data), "--format", "tum", "--out", out],
        ["live", str(data), "--out", out],
    ):
        with pytest.raises(AirgroundError, match="has no truth") as refusal:
            answer(words)
        assert "\n" not in str(refusal.value)
    with pytest.raises(InputError, match="--poses oracle: needs a recording of simulate with its"):
        answer(["run", str(data), "--poses", "oracle", "--out", out])
    assert not Path(out).exists()


def perfect(folder: Path, data: Path, truth: Path) -> Path:
    """A submission of the true poses, at the stamps of the MAV's images."""
    folder.mkdir()
    true = Truth.open(truth)
    stamps = Recording.open(data).mav.camera_stamps.tolist()
    poses = [
        true.T_world_ground_camera(stamp).inverse() @ true.T_world_mav_camera(stamp)
        for stamp in stamps
    ]
    given = Answers(Trajectory.from_poses(stamps, poses), np.ones(len(stamps), bool))
    write_answers(folder / f"{data.name}.tum", given.claims())
    return folder


def test_the_command_scores_and_ranks(
    sealed: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data, truth = sealed
    right = perfect(tmp_path / "right", data, truth / "0001")
    empty = tmp_path / "silent"
    empty.mkdir()
    line = (right / "0001.tum").read_text().splitlines()[1]
    (empty / "0001.tum").write_text(line.removesuffix("1") + "0\n")
    words = ["score", str(right), str(empty), "--truth", str(truth)]
    assert answer([*words, "--out", str(tmp_path / "scores")]) in (None, 0)
    board = json.loads((tmp_path / "scores" / "leaderboard.json").read_text())
    assert [entry["name"] for entry in board["entries"]] == ["right", "silent"]
    # Images are less than a second long: one second of the second half has claims.
    assert [sum(entry["wrong_claims"]) for entry in board["entries"]] == [0, 0]
    assert board["entries"][0]["claims"][0] >= 1
    assert board["entries"][1]["score"] == 0
    assert "right" in capsys.readouterr().out
    with pytest.raises(InputError, match="states no level; expected hard 1"):
        answer([*words, "--level", "hard"])
    with pytest.raises(InputError, match="no such folder"):
        answer(["score", str(right), "--truth", str(tmp_path / "none")])


def test_a_draw_depends_on_its_seed_alone_and_tells_nothing() -> None:
    first, again, other = (Draw(load_level("hard"), 3, seed).tries() for seed in (5, 5, 6))
    assert first == again
    seeds = [flight.seed for tries in first for flight in tries]
    assert len(set(seeds)) == len(seeds) == 15 * TRIES
    assert set(seeds).isdisjoint(flight.seed for tries in other for flight in tries)
    scenes = [tries[0].scene.name for tries in first]
    assert {scenes.count(name) for name in scenes} == {3}
    assert scenes != sorted(scenes)
    assert scenes != [tries[0].scene.name for tries in other]


def test_a_benchmark_goes_on_where_it_stopped(small: Path, tmp_path: Path) -> None:
    draw = Draw(load_level("hard"), 1, 5)
    made: list[int] = []

    def make(flight: Flight, out: Path, workers: int) -> Path:
        if flight.seed == draw.tries()[1][0].seed:
            raise InputError("this overlap cannot be had")
        if len(made) == 3 and not (tmp_path / "goes on").exists():
            raise KeyboardInterrupt
        made.append(flight.seed)
        return Path(shutil.copytree(small, out))

    data, truth = tmp_path / "data", tmp_path / "truth"
    with pytest.raises(KeyboardInterrupt):
        make_benchmark(draw, data, truth, 1, make)
    assert not data.exists()
    assert not truth.exists()
    (tmp_path / "goes on").touch()
    with pytest.raises(InputError, match="unfinished work of another level, seed, size"):
        make_benchmark(Draw(load_level("hard"), 1, 6), data, truth, 1, make)
    make_benchmark(draw, data, truth, 1, make)

    expected = [tries[0].seed for tries in draw.tries()]
    expected[1] = draw.tries()[1][1].seed  # where the first heap was impossible
    assert made == expected
    names = [f"{number:04d}" for number in range(1, 6)]
    assert sorted(path.name for path in data.iterdir()) == names
    assert [path.name for path in recordings_in(truth)] == names
    benchmark = read_benchmark(truth)
    assert benchmark is not None
    assert (str(benchmark.level), benchmark.seed) == ("hard 1", 5)
    assert not [name for name in files(data) if "truth" in name or BENCHMARK in name]


def test_a_benchmark_killed_between_its_two_folders_goes_on(small: Path, tmp_path: Path) -> None:
    draw, other = (Draw(load_level("hard"), 1, seed) for seed in (5, 6))
    data, truth = tmp_path / "data", tmp_path / "truth"

    def make(flight: Flight, out: Path, workers: int) -> Path:
        return Path(shutil.copytree(small, out))

    def never(flight: Flight, out: Path, workers: int) -> Path:
        raise AssertionError("everything is recorded")

    make_benchmark(draw, data, truth, 1, make)
    expected = files(data), files(truth)
    data.rename(tmp_path / ".data.partial")
    with pytest.raises(InputError, match="truth: exists already"):
        make_benchmark(other, data, truth, 1, never)
    make_benchmark(draw, data, truth, 1, never)
    assert (files(data), files(truth)) == expected
    with pytest.raises(InputError, match="exists already"):
        make_benchmark(draw, data, truth, 1, never)


def test_without_sealing_the_truth_stays(small: Path, tmp_path: Path) -> None:
    draw = Draw(load_level("easy"), 1, 0)
    make_benchmark(
        draw, tmp_path / "data", None, 1, lambda _, out, workers: shutil.copytree(small, out)
    )
    assert len(recordings_in(tmp_path / "data")) == 5
    assert read_benchmark(tmp_path / "data") == draw.benchmark()
    assert Truth.open(tmp_path / "data" / "0001")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--level", "hard", "--dial", "scene.light=1"], "--level hard: fixes all but"),
        (["tiny", "--level", "hard"], "--level hard: fixes all but"),
        (["tiny", "--flights", "3"], "--flights: only with --level"),
        (["tiny", "--seeds", "0-3", "--sealed", "truth"], "--seeds: without --sealed"),
        ([], "one SCENE"),
    ],
)
def test_options_that_do_not_go_together(words: list[str], message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        answer(["simulate", *words, "--out", str(tmp_path / "out")])


@pytest.mark.slow(minutes=2)
def test_from_sealed_data_to_a_score(tmp_path: Path) -> None:
    """The commands of docs/score.md over a flight too short for a surface: nothing is claimed."""
    (tmp_path / "small.toml").write_text(SCENE)
    data, truth, run = (tmp_path / name for name in ("flight", "truth", "runs/flight"))
    run.parent.mkdir()
    simulate = ["simulate", str(tmp_path / "small.toml"), "--sensors", "none", "--seed", "3"]
    assert answer([*simulate, "--out", str(data), "--sealed", str(truth)]) in (None, 0)
    assert not (data / "truth").exists()
    assert answer(["run", str(data), "--baselines", "--out", str(run)]) in (None, 0)
    assert list((run / "baselines").iterdir()) == []
    with pytest.raises(InputError, match=r"has no claims.tum; nothing was claimed"):
        answer(["submit", str(run), "--out", str(tmp_path / "submission")])
    perfect(tmp_path / "right", data, truth / "flight")
    shutil.copyfile(tmp_path / "right" / "flight.tum", run / "claims.tum")
    assert answer(["submit", str(run), "--out", str(tmp_path / "submission")]) in (None, 0)
    words = ["score", str(tmp_path / "submission"), "--truth", str(truth)]
    assert answer([*words, "--out", str(tmp_path / "scored")]) in (None, 0)
    board = json.loads((tmp_path / "scored" / "leaderboard.json").read_text())
    assert board["entries"][0]["score"] == pytest.approx(100, abs=0.01)
