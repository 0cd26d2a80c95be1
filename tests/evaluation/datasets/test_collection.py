"""Many recordings: parts without a common world, resumed where they stopped."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.errors import AirgroundError, InputError
from airground.io.recording import Recording
from evaluation import cli
from evaluation.datasets import collection
from evaluation.datasets.collection import make_dataset
from evaluation.datasets.datasheet import datasheet
from evaluation.datasets.plan import Plan, parse_seeds, parse_split, plan_dataset
from evaluation.measure.work.crew import Crew
from evaluation.setup.output import continued_folder
from sim.recording.recorder import record
from sim.scene import load_scene
from sim.sensors.presets import NOMINAL
from tests.sim.small_flight import SCENE


@given(st.lists(st.integers(0, 500), min_size=1))
def test_seeds_come_back_from_their_text(seeds: list[int]) -> None:
    assert parse_seeds(",".join(map(str, seeds))) == sorted(set(seeds))
    assert parse_seeds(f"{min(seeds)}-{max(seeds)}") == list(range(min(seeds), max(seeds) + 1))


@pytest.mark.parametrize("text", ["", "a", "1,,2", "3-1", "-1", "0-99999999999", "1.5", "9" * 5000])
def test_other_texts_are_no_seeds(text: str) -> None:
    with pytest.raises(InputError, match="--seeds"):
        parse_seeds(text)


@pytest.mark.parametrize("texts", [["test"], ["test=x"], ["test=0"], ["test=1"], ["train=0.5"]])
def test_other_texts_are_no_split(texts: list[str]) -> None:
    with pytest.raises(InputError, match="--split"):
        parse_split(texts)


def test_something_must_be_left_to_train() -> None:
    with pytest.raises(InputError, match="nothing is left"):
        parse_split(["test=0.5", "val=0.5"])


@settings(deadline=None)
@given(
    count=st.integers(1, 60),
    shares=st.tuples(st.floats(0.01, 0.5), st.floats(0.01, 0.4)),
    sensors=st.sampled_from(["none", "harsh"]),
)
def test_a_split_keeps_worlds_apart(count: int, shares: tuple[float, float], sensors: str) -> None:
    parts = dict(zip(("test", "val"), shares, strict=True))
    plan = plan_of(count, parts, sensors)
    worlds = [(world.name, world.seed) for world in plan.worlds]
    assert len(set(worlds)) == len(worlds) == 2 * count
    for part, share in parts.items():
        assert sum(w.part == part for w in plan.worlds) == round(share * 2 * count)
    other = plan_of(count, parts, "nominal")
    assert [w.part for w in plan.worlds] == [w.part for w in other.worlds]


def plan_of(count: int, shares: dict[str, float], sensors: str = "nominal") -> Plan:
    scenes = ["tiny", "flat"]
    return plan_dataset(scenes, range(count), shares, sensors, None)


Made = list[str]


@pytest.fixture
def made(small: Path, monkeypatch: pytest.MonkeyPatch) -> Made:
    """Recordings are copies of a small one, made in this process; their names are noted."""
    names: Made = []

    def copy(scene: Any, seed: int, preset: Any, out: Path, *_: object, **__: object) -> None:
        if seed == 666:
            raise AirgroundError("impossible")
        shutil.copytree(small, out)
        names.append(f"{scene.name} {seed}")

    def one_by_one(_: Crew, function: Callable, tasks: Sequence) -> Iterator:
        return ((index, function(task)) for index, task in enumerate(tasks))

    monkeypatch.setattr(collection, "record", copy)
    monkeypatch.setattr(Crew, "outcomes", one_by_one)
    monkeypatch.setattr(collection, "end_with_parent", lambda: None)
    return names


def test_what_was_made_is_not_made_again(made: Made, tmp_path: Path) -> None:
    plan = plan_of(2, {"test": 0.25})
    stopped = plan.model_copy(
        update={"worlds": (*plan.worlds[:3], plan.worlds[3].model_copy(update={"seed": 666}))}
    )
    with pytest.raises(AirgroundError, match="flat, seed 666: impossible"):
        make_dataset(stopped, tmp_path / "out", 1, 1)
    assert len(made) == 3
    assert not (tmp_path / "out").exists()
    unfinished = tmp_path / ".out.partial"
    (unfinished / "train" / ".flat_s1.partial-aaaaaaaa").mkdir(parents=True)
    with pytest.raises(InputError, match="unfinished work of another plan"):
        make_dataset(plan, tmp_path / "out", 1, 1)
    (unfinished / "dataset.json").write_text(plan.model_dump_json())
    make_dataset(plan, tmp_path / "out", 1, 1)
    assert made == ["tiny 0", "tiny 1", "flat 0", "flat 1"]
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    found = {str(p.parent.relative_to(tmp_path / "out")) for p in tmp_path.rglob("recording.toml")}
    assert found == {world.folder for world in plan.worlds}
    assert not list(tmp_path.rglob(".*"))
    with pytest.raises(InputError, match="exists already"):
        make_dataset(plan, tmp_path / "out", 1, 1)


def test_two_do_not_work_on_one_dataset(made: Made, tmp_path: Path) -> None:
    with (
        continued_folder(tmp_path / ".out.partial"),
        pytest.raises(InputError, match="another process works on it"),
    ):
        make_dataset(plan_of(1, {}), tmp_path / "out", 1, 1)
    assert made == []


def test_the_data_sheet_states_the_facts(made: Made, tmp_path: Path, small: Path) -> None:
    plan = plan_of(2, {"test": 0.25})
    make_dataset(plan, tmp_path / "out", 1, 1)
    sheet = (tmp_path / "out" / "DATASHEET.md").read_text()
    header = Recording.open(small).header
    assert f"| train | 3 | {3 * header.duration_s:g} | {3 * header.frames.mav} |" in sheet
    assert f"| test | 1 | {header.duration_s:g} | {header.frames.mav} |" in sheet
    for name in ("tiny", "flat"):
        scene = load_scene(name)
        assert f"| {scene.name} | {scene.description} |" in sheet
    assert NOMINAL.imu is not None
    assert f"| imu | accelerometer_density | {NOMINAL.imu.accelerometer_density} |" in sheet
    for heading in ("Geometry", "Sensors", "Noise", "Frames and units", "Known limits"):
        assert f"## {heading}" in sheet
    for world in plan.worlds:
        assert re.search(rf"\| {world.folder} \| .* \d+\.\d \| \d+\.\d \|", sheet)


def test_the_data_sheet_says_where_the_robots_see_two_worlds(small: Path) -> None:
    tiny = load_scene("tiny")
    changed = {
        "rubble": tiny.rubble.model_copy(update={"changed": 0.25}),
        "flight_light": tiny.light.model_copy(update={"main": 0.2}),
        "ground": tiny.ground.model_copy(update={"lamp": 1.0}),
    }
    plain, two = (
        datasheet("made", [scene], NOMINAL, [("train", small)])
        for scene in (tiny, tiny.model_copy(update=changed))
    )
    added = [line for line in two.splitlines() if line not in plain.splitlines()]
    assert [line.split(":")[0] for line in added] == ["- `tiny`"] * 3
    assert "25 % of the boxes" in added[0]


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["tiny", "flat"], "only with --seeds"),
        (["tiny", "--split", "test=0.2"], "only with --seeds"),
        (["tiny", "--seeds", "0-1", "--seed", "3"], "no --seed, --flight or --dial"),
        (["tiny", "tiny", "--seeds", "0"], "two scenes have the same name"),
        (["tiny", "--seeds", "0", "--jobs", "0"], "--jobs 0: must be from 1"),
        (["no_such_scene", "--seeds", "0"], "no_such_scene"),
    ],
)
def test_words_without_a_meaning_are_refused(
    words: list[str], named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        cli.main(["simulate", *words, "--out", str(tmp_path / "out")])
    assert ended.value.code == 2
    assert named in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.subject(
    "evaluation/cli.py",
    "evaluation/commands/data.py",
    "evaluation/datasets",
    "evaluation/measure/work",
    "evaluation/setup",
    "sim",
    "airground/core",
    "airground/errors.py",
    "airground/io",
)
def test_a_killed_dataset_is_finished_by_the_next_call(tmp_path: Path) -> None:
    """SIGKILL at any time leaves whole recordings only, and the same bytes in the end."""
    scene = tmp_path / "small.toml"
    scene.write_text(SCENE)
    out, unfinished = tmp_path / "out", tmp_path / ".out.partial"
    words = ["simulate", str(scene), "--seeds", "0-2", "--jobs", "2"]
    code = "import sys; from evaluation.cli import main; main(sys.argv[1:])"
    command = [sys.executable, "-c", code, *words, "--out", str(out), "--threads", "2"]
    deadline = time.monotonic() + 1200
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            while not list(unfinished.glob("train/small_s*")):
                assert process.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.05)
        finally:
            process.kill()
    assert not out.exists()
    before = {p.name: p.stat().st_mtime_ns for p in unfinished.glob("train/small_s*")}
    assert 1 <= len(before) < 3
    for name in before:
        Recording.open(unfinished / "train" / name).verify()
    while subprocess.run(command, capture_output=True).returncode != 0:
        assert time.monotonic() < deadline  # children of the killed one may hold on for a moment
    recordings = sorted(out.glob("train/small_s*"))
    assert [path.name for path in recordings] == ["small_s0", "small_s1", "small_s2"]
    for name, made in before.items():
        assert (out / "train" / name).stat().st_mtime_ns == made
    again = record(load_scene(str(scene)), 2, NOMINAL, tmp_path / "again", workers=1)
    digests = [Recording.open(path).header.digests for path in (again, recordings[2])]
    assert digests[0] == digests[1]
    assert not list(tmp_path.rglob("*.partial*"))
