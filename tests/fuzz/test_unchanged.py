"""The fuzzer's own parts: changes that change nothing, bombs, and what it takes for a finding."""

from __future__ import annotations

import io
import json
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from airground.core.cloud import Source
from airground.errors import InputError, RecordingError
from airground.io.array_files import UNREADABLE_ARRAYS, read_arrays
from airground.io.images import read_grey
from airground.io.input_files import SETTINGS_LIMIT, read_bytes, read_text, read_toml_text
from airground.io.open_recording import open_robot
from tests.fuzz import case
from tests.fuzz.bombs import bomb_mcap, bomb_npz, bomb_png
from tests.fuzz.harmless import changes_of, put_behind_link
from tests.fuzz.meaning import meaning
from tests.fuzz.subjects import Subject
from tests.io.test_ros_bags import flying

TOML = b'a = 1\nb = "x"\n[c]\nd = [1.5, 2.5]\ne = true\n'
DRAWS = 12


def make(folder: Path) -> None:
    (folder / "a.toml").write_bytes(TOML)
    (folder / "list").mkdir()
    (folder / "list" / "b.csv").write_bytes(b"#n,x\n1,0.5\n2,0.25\n")


def read_well(folder: Path, out: Path) -> tuple[dict[str, Any], list[list[float]]]:
    try:
        lines = read_text(folder / "list/b.csv", SETTINGS_LIMIT).splitlines()
        rows = [line.split(",") for line in lines if line and line[0] != "#"]
        numbers = [[float(cell) for cell in row] for row in rows]
        return read_toml_text(folder / "a.toml"), numbers
    except ValueError as error:
        raise InputError(str(error)) from None


def read_wrongly(folder: Path, out: Path) -> object:
    """Takes the order of keys, comments and line ends for a meaning."""
    names = "a.toml", "list/b.csv"
    return read_well(folder, out), [read_bytes(folder / name, SETTINGS_LIMIT) for name in names]


@pytest.mark.parametrize("read", [read_well, read_wrongly])
def test_an_input_that_means_something_else_is_a_finding(
    read: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    subject = Subject(make, read, read)  # type: ignore[arg-type]
    monkeypatch.setattr(case, "SUBJECTS", {"small": subject})
    bench = case.Bench(tmp_path)
    bench.check_good()
    found = [bench.run(0, number, lambda *what: None) for number in range(60)]
    unchanged = [one for one in found if one.damage == case.UNCHANGED]
    assert len(unchanged) > 2
    verdicts = {one.verdict for one in unchanged}
    expected = {"works"} if read is read_well else {"works", "means something else"}
    assert verdicts == expected
    assert not (tmp_path / "in/small/list/kept").exists()
    assert (tmp_path / "in/small/a.toml").read_bytes() == TOML


def test_changes_of_text_change_bytes_alone() -> None:
    rng = np.random.default_rng(0)
    for change in changes_of(Path("a.toml"), TOML).values():
        assert tomllib.loads(change(TOML, rng).decode()) == tomllib.loads(TOML.decode())
    table = json.dumps({"a": [1, {"b": 0.1, "c": None}], "d": "x"}).encode()
    changes = changes_of(Path("a.json"), table)
    assert {json.dumps(json.loads(change(table, rng))) for change in changes.values()}
    for change in changes.values():
        assert json.loads(change(table, rng)) == json.loads(table)
    assert changes_of(Path("parts.csv"), b"name,x [m]\nbox,1\n") == {}


def test_links_lead_to_where_the_file_is_now(tmp_path: Path) -> None:
    file = tmp_path / "recording" / "mav0" / "data.csv"
    file.parent.mkdir(parents=True)
    file.write_text("1\n")
    put_behind_link(file, tmp_path)
    assert file.is_symlink()
    assert file.read_text() == "1\n"
    assert (tmp_path / "recording" / "kept").is_file()


@dataclass
class Reading:
    stamps: np.ndarray
    name: str


def test_meanings_differ_in_values_and_types_alone() -> None:
    one = Reading(np.arange(3), "a")
    assert meaning(one) == meaning(Reading(np.arange(3), "a"))
    assert meaning({"a": 1, "b": 2}) == meaning({"b": 2, "a": 1})
    others = [
        *(Reading(np.arange(4), "a"), Reading(np.arange(3.0), "a"), Reading(np.arange(3), "b")),
        *([one], [one, one], {"a": 1}, {"a": 1.0}, (), [[], []], [[[]]]),
    ]
    assert len({meaning(other) for other in (one, *others)}) == 1 + len(others)
    with pytest.raises(TypeError, match="no digest"):
        meaning(object())


def test_bombs_are_small_and_refused(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    out = io.BytesIO()
    np.savez(out, a=np.arange(5.0), b=np.eye(3))
    path = tmp_path / "motion.npz"
    for _ in range(DRAWS):
        data = bomb_npz(out.getvalue(), rng)
        assert len(data) < 4 << 20
        path.write_bytes(data)
        with pytest.raises(UNREADABLE_ARRAYS):
            read_arrays(path)
    png = cv2.imencode(".png", rng.integers(0, 256, (6, 8), np.uint8))[1].tobytes()
    refused = 0
    for _ in range(DRAWS):
        (tmp_path / "a.png").write_bytes(bomb_png(png, rng))
        try:
            read_grey(tmp_path / "a.png", 8, 6)
        except RecordingError:
            refused += 1
    assert refused >= DRAWS // 2  # a long comment does no harm


def test_chunks_of_a_bag_that_state_another_size(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    path = next(flying(False).write(tmp_path / "mav").glob("*.mcap"))
    data = path.read_bytes()
    messages = sum(1 for _ in open_robot(path, Source.MAV).messages())
    assert messages > 0
    for _ in range(DRAWS):
        path.write_bytes(bomb_mcap(data, rng))
        assert path.stat().st_size < len(data) + (1 << 20)
        with pytest.raises(RecordingError):
            list(open_robot(path, Source.MAV).messages())
