"""What baselines claim of a recording without truth, and the submissions that it makes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from airground.config import Config
from airground.core.events import Sighted
from airground.core.se3 import SE3
from airground.errors import InputError
from evaluation.cli import answer, parse
from evaluation.commands.run import Run
from evaluation.measure.baselines.claims import BaselineClaims, without_truth
from evaluation.measure.baselines.interface import Answer, Baseline, Given
from evaluation.measure.baselines.table import BASELINES
from evaluation.run.onlooker import Onlooker, Seen
from evaluation.table.answer_file import read_answers
from tests.evaluation.measure.closed_worlds import (
    T_GROUND_MAV,
    bare_floor,
    boxes_on_floor,
    error_of,
    given_of,
)
from tests.evaluation.run.test_claim_log import MS, both
from tests.evaluation.show.scripted_run import mav_frame

TIMES = range(0, 1000, 50)


def sighted(given: Given, when_ms: int) -> Seen:
    return Seen(Sighted(1, given.sighting), 0.0, mav_frame(when_ms * MS), given.sighting)


def written(claims: BaselineClaims, folder: Path, given: Given) -> list[str]:
    """The files of a run in which both robots stand still."""
    sighting = given.sighting
    poses = sighting.T_mav_camera, sighting.T_ground_camera
    claims.write(folder, both(*(dict.fromkeys(TIMES, pose) for pose in poses)))
    return sorted(file.stem for file in (folder / "baselines").iterdir())


def test_a_claim_is_the_place_and_holds_until_the_next_one(tmp_path: Path) -> None:
    given = given_of(boxes_on_floor())
    places = iter([None, T_GROUND_MAV, None, SE3(np.eye(3), np.array([3.0, 0.0, 0.0]))])

    def scripted(_: Given) -> Answer:
        place = next(places)
        return Answer(place, "nothing" if place is None else "")

    claims = BaselineClaims(Config(), 0, [Baseline("scripted", "", "", scripted)])
    for when in (100, 200, 400, 600):
        claims.see(sighted(given, when))
    assert written(claims, tmp_path, given) == ["scripted"]
    path = read_answers(tmp_path / "baselines" / "scripted.tum").claims()
    off = {}
    for stamp, T_ground_camera_mav_camera in path:
        T_ground_mav = (
            given.sighting.T_ground_camera
            @ T_ground_camera_mav_camera
            @ given.sighting.T_mav_camera.inverse()
        )
        off[stamp // MS] = error_of(T_ground_mav, given)[0]
    assert list(off) == [time for time in TIMES if time >= 200]
    assert max(value for time, value in off.items() if time < 600) < 1e-5
    assert min(value for time, value in off.items() if time >= 600) > 1


def test_a_refused_guess_and_a_bare_floor_claim_nothing(tmp_path: Path) -> None:
    given = given_of(bare_floor())
    refused = Baseline("refused", "", "", lambda _: Answer(T_GROUND_MAV, "not sure"))
    ours = [one for one in BASELINES if one.name == "ours_first"]
    claims = BaselineClaims(Config(), 0, [refused, *ours])
    claims.see(sighted(given, 100))
    assert written(claims, tmp_path, given) == []


def test_the_height_maps_of_a_closed_world_are_found(tmp_path: Path) -> None:
    given = given_of(boxes_on_floor())
    asked = [one for one in BASELINES if one.name in ("ncc", "scan_context")]
    claims = BaselineClaims(Config(), 0, asked)
    claims.see(sighted(given, 100))
    assert written(claims, tmp_path, given) == ["ncc", "scan_context"]
    true = given.sighting.T_ground_camera.inverse() @ T_GROUND_MAV @ given.sighting.T_mav_camera
    for name in ("ncc", "scan_context"):
        path = read_answers(tmp_path / "baselines" / f"{name}.tum").claims()
        assert np.linalg.norm(path[0][1].translation - true.translation) < 0.1


def test_who_needs_truth_or_a_package_is_not_asked() -> None:
    names = {one.name for one in without_truth()}
    assert {"zmssd", "ncc", "scan_context", "fpfh", "ours_first"} <= names
    # Ground images are chosen by the noisy prior, which is made from the truth.
    assert names.isdisjoint({"sift", "asift", "xfeat", "disk", "icp", "ours_refined", "oracle"})

    def never(_: Given) -> Answer:
        raise AssertionError("is not installed")

    absent = Baseline("absent", "", "", never, module="airground_no_such_module")
    claims = BaselineClaims(Config(), 0, [absent])
    claims.see(sighted(given_of(bare_floor()), 100))
    assert list(claims.missing) == ["absent"]


def test_run_asks_them_as_onlookers_where_they_are_wanted() -> None:
    for words, wanted in (([], False), (["--baselines"], True)):
        verb = parse("run", ["recording", "--out", "x", *words])
        assert isinstance(verb, Run)
        onlookers: list[Onlooker] = []
        asked = verb._baselines(verb.setup(), 0, onlookers)
        assert onlookers == ([asked] if wanted else [])
        assert (asked is not None) == wanted


def run_folder(folder: Path, *names: str) -> Path:
    """A run in which these baselines claimed a place."""
    (folder / "baselines").mkdir(parents=True)
    for name in names:
        (folder / "baselines" / f"{name}.tum").write_text(f"{name} over {folder.name}\n")
    return folder


def test_each_baseline_has_a_submission_of_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = run_folder(tmp_path / "runs/0001", "ncc", "fpfh")
    second = run_folder(tmp_path / "runs/0002", "ncc")
    out = tmp_path / "submissions"
    words = ["submit", str(first), str(second), "--baselines", "--out", str(out)]
    assert answer(words) in (None, 0)
    files = {str(file.relative_to(out)): file.read_text() for file in out.rglob("*.tum")}
    assert files == {
        "ncc/0001.tum": "ncc over 0001\n",
        "ncc/0002.tum": "ncc over 0002\n",
        "fpfh/0001.tum": "fpfh over 0001\n",
    }
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(": ")[1] for line in lines] == [
        "1 of 2 runs claimed something",
        "2 of 2 runs claimed something",
    ]


def test_a_run_without_baselines_and_none_that_claimed_are_one_line_each(tmp_path: Path) -> None:
    (tmp_path / "plain").mkdir()
    out = ["--baselines", "--out", str(tmp_path / "out")]
    with pytest.raises(InputError, match=r"plain: has no baselines; expected what run --baselines"):
        answer(["submit", str(tmp_path / "plain"), *out])
    silent = run_folder(tmp_path / "silent")
    with pytest.raises(InputError, match=r"has no baselines/\*\.tum; nothing was claimed"):
        answer(["submit", str(silent), *out])
    assert not (tmp_path / "out").exists()
