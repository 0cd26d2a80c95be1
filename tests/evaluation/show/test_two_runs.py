"""Two runs in one file: both are there, on one clock, in two colours; their difference is found."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from airground.core.events import BeliefUpdated, MavTracked
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.io.tum import write_tum
from airground.tracking import TrackedFrame
from evaluation import cli
from evaluation.judge.summary import build_summary
from evaluation.run.onlooker import Seen
from evaluation.setup import console
from evaluation.show.rerun_view import viewer
from evaluation.show.rerun_view.run_view import RunView
from evaluation.show.rerun_view.trace import RunFile, read_traces
from evaluation.show.rerun_view.two_runs import FIRST_COLOUR, SECOND_COLOUR, SHARED_TRUTH
from evaluation.show.rerun_view.two_runs_layout import FROM_DIFFERENCE
from tests.evaluation.judge.flights import make_results
from tests.evaluation.show.made_runs import INFO
from tests.evaluation.show.scripted_run import (
    BELIEF,
    CLOUD,
    CONFIG,
    DOWN,
    LENSES,
    SECOND,
    T_BELIEVED,
    T_GROUND_MAV,
    TIMES_NS,
    TRUTH,
    ReadBack,
    seen_events,
    show,
    written,
)

STEP_NS = SECOND // 30
LIFTED_FROM = 31
"""Image from which a made path lies higher."""
MOVED = np.array([0.0, 0.0, 0.05])


def believed_elsewhere() -> list[Seen]:
    """The scripted run, with a belief that is 10 cm off in x."""
    shifted = replace(BELIEF, T_ground_mav=SE3.from_heading(0.3, [1.2, 0.2, 0.1]))
    return [
        replace(seen, event=BeliefUpdated(seen.event.stamp_ns, shifted))
        if isinstance(seen.event, BeliefUpdated)
        else seen
        for seen in seen_events()
    ]


def lifted() -> list[Seen]:
    """The scripted run, with the MAV higher from 3 s on."""
    higher = SE3(DOWN.rotation, DOWN.translation + MOVED)

    def moved(frame: TrackedFrame) -> TrackedFrame:
        return replace(frame, pose=replace(frame.pose, T_map_camera=higher))

    return [
        replace(seen, frame=moved(seen.frame))
        if isinstance(seen.event, MavTracked) and seen.event.stamp_ns >= 3 * SECOND
        else seen
        for seen in seen_events()
    ]


def made(folder: Path, events: list[Seen] | None = None, truth: bool = True) -> Path:
    folder.mkdir()
    written(folder / "run.rrd", truth=TRUTH if truth else None, events=events)
    return folder


def keep_paths(folder: Path, lifted_from: int | None = None) -> None:
    """Poses of every image, as `run` keeps them; of the MAV, higher ones from an image on."""
    stamps = [SECOND + index * STEP_NS for index in range(91)]
    stamps = sorted({*stamps, 2 * SECOND, 3 * SECOND})
    high = [lifted_from is not None and index >= lifted_from for index in range(len(stamps))]
    poses = [SE3(DOWN.rotation, DOWN.translation + MOVED * is_high) for is_high in high]
    for robot, kept in (("mav", poses), ("ground", [SE3.identity()] * len(stamps))):
        write_tum(folder / f"{robot}_live.tum", Trajectory.from_poses(stamps, kept))


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    root = tmp_path_factory.mktemp("runs")
    return {
        "base": made(root / "base"),
        "again": made(root / "again"),
        "shifted": made(root / "shifted", believed_elsewhere()),
        "refused": made(root / "refused", seen_events(accepted=False)),
        "lifted": made(root / "lifted", lifted()),
        "untrue": made(root / "untrue", truth=False),
    }


def viewed(folders: dict[str, Path], names: Sequence[str], out: Path) -> Path:
    """The saved view of two runs."""
    cli.parse("view", [*(str(folders[name]) for name in names), "--save", str(out)]).main()
    return out


@pytest.fixture(scope="module")
def both(folders: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> ReadBack:
    out = tmp_path_factory.mktemp("saved") / "both.rrd"
    return ReadBack(viewed(folders, ("base", "shifted"), out))


def test_the_file_holds_everything_of_both(both: ReadBack, folders: dict[str, Path]) -> None:
    first = ReadBack(folders["base"] / "run.rrd")
    assert both.entities >= first.entities
    dropped = tuple(rule[2:].removesuffix("/**") for rule in SHARED_TRUTH if rule[0] == "-")
    expected = {f"/second{name}" for name in first.entities if not name.startswith(dropped)}
    assert {name for name in both.entities if name.startswith("/second/")} >= expected
    assert not any(name.startswith("/second/truth/scene") for name in both.entities)
    assert both.timelines == {"sensor_time", FROM_DIFFERENCE}
    for entity in ("/mav/camera", "/events", "/curves/spread_m", "/mav/camera/image"):
        assert both.stamps_ns(f"/second{entity}") == first.stamps_ns(entity)


def test_it_passes_rerun_s_own_check_and_has_one_layout(
    folders: dict[str, Path], tmp_path: Path
) -> None:
    out = viewed(folders, ("base", "again"), tmp_path / "both.rrd")
    viewer.verify(out)
    assert len(RrdReader(out).blueprints()) == 1
    assert len(RrdReader(out).recordings()) == 1


def test_frames_of_the_second_are_its_own(both: ReadBack) -> None:
    parents = both.values("/second/mav/camera", "Transform3D:parent_frame")
    children = both.values("/second/mav/camera", "Transform3D:child_frame")
    assert {name for row in parents for name in row} == {"second_mav"}
    assert {name for row in children for name in row} == {"second_mav_camera"}
    assert both.values("/second/ground/map", "CoordinateFrame:frame") == [["second_ground"]]
    assert both.values("/mav/camera", "Transform3D:parent_frame")[0] == ["mav"]
    # Both ground maps lie on each other.
    assert both.values("/second/ground", "Transform3D:parent_frame") == [["ground"]]
    assert both.values("/second/ground", "Transform3D:translation") == [[[0, 0, 0]]]


def rgb(packed: int) -> tuple[int, int, int]:
    return packed >> 24, packed >> 16 & 0xFF, packed >> 8 & 0xFF


def test_colours_and_names_tell_them_apart(both: ReadBack) -> None:
    for root, colour, name in (("", FIRST_COLOUR, "base"), ("/second", SECOND_COLOUR, "shifted")):
        assert rgb(both.values(f"{root}/mav/path", "LineStrips3D:colors")[-1][0]) == colour
        curve = f"{root}/truth/error/translation_m/refined"
        assert rgb(both.values(curve, "SeriesLines:colors")[0][0]) == colour
        assert both.values(curve, "SeriesLines:names") == [[f"{name}: refined"]]
        assert rgb(both.values(f"{root}/curves/spread_m", "SeriesLines:colors")[0][0]) == colour
        said = both.values(f"{root}/events", "TextLog:text")
        assert all(text[0].startswith(f"{name}: ") for text in said)
        surface = np.array(
            [rgb(c) for c in both.values(f"{root}/mav/surface", "Points3D:colors")[0]]
        )
        np.testing.assert_allclose(
            surface / surface.max(), np.tile(colour, (3, 1)) / 255, atol=0.02
        )
    assert len(both.values("/second/mav/surface", "Points3D:positions")[0]) == len(CLOUD)
    grey = rgb(both.values("/ground/map", "Points3D:colors")[-1][0])
    assert len(set(grey)) == 1


def test_the_truth_is_drawn_once_and_stays_pink(both: ReadBack) -> None:
    first = both.values("/truth/mav/path", "LineStrips3D:colors")[-1][0]
    assert rgb(first) == (255, 60, 200)
    assert "/second/truth/mav/path" not in both.entities
    assert "/second/truth/position" in both.entities  # it lies on that run's cost map


def test_the_difference_is_marked_where_it_is(both: ReadBack) -> None:
    assert both.stamps_ns("/differences") == [3 * SECOND]
    ((said,),) = both.values("/differences", "TextLog:text")
    assert said.startswith("belief differs: 0.100 m apart")
    assert [s for s in both.stamps_ns("/differences/curves") if s] == [3 * SECOND]


def test_the_view_opens_at_the_difference(folders: dict[str, Path], tmp_path: Path) -> None:
    """On a clock that begins there, with all that was set before, and no earlier curves."""
    out = viewed(folders, ("base", "shifted"), tmp_path / "both.rrd")
    began: dict[str, list[int]] = {}
    for chunk in RrdReader(out).stream().filter(has_timeline=FROM_DIFFERENCE):
        times = chunk.to_record_batch().column(FROM_DIFFERENCE).cast(pa.int64()).to_pylist()
        began.setdefault(chunk.entity_path, []).extend(times)
    assert min(min(times) for times in began.values()) == 3 * SECOND
    assert began["/ground/camera"] == [3 * SECOND]  # set at 1 s
    assert sorted(began["/second/mav/camera/image"])[-1] == 4 * SECOND
    assert began["/curves/corners/mav"] == [3 * SECOND]  # not that of 2 s
    (shown,) = RrdReader(out).blueprints()
    panel = RrdReader(out).stream(store=shown).filter(content="/time_panel")
    said = [str(chunk.to_record_batch().to_pydict()) for chunk in panel]
    assert any(FROM_DIFFERENCE in text for text in said)


def test_equal_runs_have_the_sensors_clock_alone(folders: dict[str, Path], tmp_path: Path) -> None:
    read = ReadBack(viewed(folders, ("base", "again"), tmp_path / "both.rrd"))
    assert read.timelines == {"sensor_time"}


@pytest.mark.parametrize(
    ("other", "conclusion"),
    [
        ("again", "no difference that is more than small"),
        ("shifted", "the belief differs first, at 3.000 s"),
        ("refused", "the alignment differs first, at 3.000 s"),
        ("lifted", "the MAV's pose differs first, at 3.000 s"),
    ],
)
def test_the_table_names_where_they_part(
    other: str,
    conclusion: str,
    folders: dict[str, Path],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    viewed(folders, ("base", other), tmp_path / "both.rrd")
    said = " ".join(capsys.readouterr().out.split())
    assert f"{other} against base: {conclusion}" in said
    marked = "/differences" in ReadBack(tmp_path / "both.rrd").entities
    assert marked == (other != "again")


def test_kept_trajectories_find_it_to_the_image(tmp_path: Path) -> None:
    files = []
    for name, since in (("one", None), ("other", LIFTED_FROM)):
        keep_paths(made(tmp_path / name), since)
        files.append(RunFile.open(tmp_path / name / "run.rrd", name))
    one, other = read_traces(*files)
    differs = np.any(one.poses["mav"].translations != other.poses["mav"].translations, axis=1)
    assert np.argmax(differs) == LIFTED_FROM
    # Poses on another clock than the file's would not be its images'.
    shifted = Trajectory.from_poses([7], [SE3.identity()])
    write_tum(tmp_path / "other/mav_live.tum", shifted)
    assert len(read_traces(*files)[1].poses["mav"]) == 2


def test_a_trace_is_what_the_run_did(folders: dict[str, Path]) -> None:
    files = [RunFile.open(folders[name] / "run.rrd", name) for name in ("base", "refused")]
    base, refused = read_traces(*files)
    (stamp,) = base.beliefs
    assert stamp == 3 * SECOND
    belief, alignment = base.beliefs[stamp], base.alignments[stamp]
    assert belief.T_ground_mav is not None
    assert alignment.T_ground_mav is not None
    np.testing.assert_allclose(belief.T_ground_mav.matrix(), T_BELIEVED.matrix(), atol=1e-6)
    np.testing.assert_allclose(alignment.T_ground_mav.matrix(), T_GROUND_MAV.matrix(), atol=1e-6)
    points = base.surfaces[stamp].points_mav
    assert points is not None
    assert points.shape == CLOUD.points.shape
    assert refused.alignments[stamp].T_ground_mav is None


def refused(words: Sequence[Path | str]) -> str:
    with pytest.raises(InputError) as error:
        cli.parse("view", [*map(str, words), "--save", "nowhere.rrd"]).main()
    return str(error.value)


def test_runs_that_cannot_be_compared_are_refused(
    folders: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    base, again = folders["base"], folders["again"]
    view = RunView(tmp_path / "elsewhere.rrd", "another", LENSES, TRUTH, CONFIG, TIMES_NS)
    show(view, seen_events())
    view.close()
    with rr.RecordingStream("other", recording_id="scripted") as stream:
        stream.save(tmp_path / "other.rrd")
        stream.log("somewhere", rr.Points3D([[0, 0, 0]]))
    assert "is a run over another" in refused([base, tmp_path / "elsewhere.rrd"])
    assert "has no truth" in refused([base, folders["untrue"]])
    assert "has no truth" in refused([folders["untrue"], base])
    assert "given twice" in refused([base, base / "run.rrd"])
    assert "3 runs given" in refused([base, again, folders["lifted"]])
    assert "0 runs given" in refused([])
    assert "no such folder" in refused([base, tmp_path / "missing"])
    assert "holds no camera" in refused([base, tmp_path / "other.rrd"])
    assert {path.name for path in tmp_path.iterdir()} == {"elsewhere.rrd", "other.rrd"}


def test_files_are_named_by_their_folders(
    folders: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = {name: folders[name] / "run.rrd" for name in ("base", "again")}
    viewed(files, ("base", "again"), tmp_path / "both.rrd")
    assert "again against base" in capsys.readouterr().out


def test_two_runs_without_truth_have_no_panel_for_it(
    folders: dict[str, Path], tmp_path: Path
) -> None:
    plain = {"one": folders["untrue"], "two": made(tmp_path / "two", truth=False)}
    read = ReadBack(viewed(plain, ("one", "two"), tmp_path / "both.rrd"))
    assert not any("/truth" in entity for entity in read.entities)
    assert "/second/curves/spread_m" in read.entities


@pytest.mark.parametrize("other", ["again", "shifted"])
def test_check_says_since_when_it_is_worse(
    other: str, folders: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    runs = []
    for name, factors in (("base", {}), (other, {"error_m": 1.5})):
        runs.append(tmp_path / name)
        runs[-1].mkdir()
        shutil.copy(folders[name] / "run.rrd", runs[-1])
        table = make_results(range(10), factors)
        table.write(runs[-1] / "results.parquet")
        build_summary(table, table.conditions()[0], INFO).write(runs[-1] / "summary.json")
    code = cli.parse("check", [str(runs[1]), "--against", str(runs[0])]).main()
    assert code == console.EXIT_WORSE
    said = " ".join(capsys.readouterr().out.split())
    assert ("since when it is worse" in said) == (other == "shifted")
    assert ("belief 3.000 0.100 m apart" in said) == (other == "shifted")
    (runs[0] / "run.rrd").write_bytes(b"RRF2 but not really")
    assert cli.parse("check", [str(runs[1]), "--against", str(runs[0])]).main() == code
    assert "since when" not in capsys.readouterr().out
