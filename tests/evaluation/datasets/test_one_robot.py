"""What commands make of a recording of one robot alone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from airground.core.cloud import Source
from airground.io.open_recording import open_robot
from evaluation import cli
from evaluation.commands.options import on_disk
from evaluation.datasets.formats import robots_in
from evaluation.datasets.simulated import Simulated
from evaluation.setup import console
from sim.recording import recorder
from sim.robots.motion import ROBOTS, Robot
from tests.evaluation.conftest import IMAGES, images_in_flight
from tests.sim.small_flight import SCENE

NAMES = {"mav": "MAV", "ground": "ground robot"}


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[Robot, Path]]:
    """One of each robot, made by the command."""
    folder = tmp_path_factory.mktemp("alone")
    (folder / "small.toml").write_text(SCENE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", images_in_flight)
        for robot in ROBOTS:
            words = ["simulate", str(folder / "small.toml"), "--only", robot, "--seed", "3"]
            assert cli.answer([*words, "--out", str(folder / robot)]) is None
        yield {robot: folder / robot for robot in ROBOTS}


def refused(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """The line with which the command refuses; its exit code is that of an error."""
    with pytest.raises(SystemExit) as exit_:
        cli.main([str(word) for word in words])
    assert exit_.value.code == console.EXIT_ERROR
    lines = [line for line in capsys.readouterr().err.splitlines() if "error:" in line]
    assert len(lines) == 1
    return lines[0]


def test_images_are_those_of_a_recording_of_both(
    recordings: dict[Robot, Path], small: Path
) -> None:
    for folder in ("mav0/cam0/data", "ground/rgb", "ground/depth"):
        robot: Robot = "mav" if folder.startswith("mav") else "ground"
        own = sorted((recordings[robot] / folder).iterdir())
        assert len(own) == IMAGES
        for file in own:
            assert file.read_bytes() == (small / folder / file.name).read_bytes()


@pytest.mark.parametrize("robot", ROBOTS)
def test_who_needs_both_robots_says_so(
    recordings: dict[Robot, Path],
    robot: Robot,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path, out = recordings[robot], tmp_path / "out"
    for words in (["run", path, "--out", out], ["live", path, "--out", out]):
        assert f"{path}: holds the {NAMES[robot]} alone" in refused(capsys, *words)
    other = "ground" if robot == "mav" else "mav"
    said = f"{path}: holds the {NAMES[robot]}, not the {NAMES[other]}"
    assert said in refused(capsys, "track", path, "--robot", other, "--out", out)
    words = ["export", path, "--format", "mcap", "--robot", "both", "--out", out]
    assert said in refused(capsys, *words)
    assert list(tmp_path.iterdir()) == []


def test_formats_of_the_other_robot_are_refused(
    recordings: dict[Robot, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = ["--out", tmp_path / "out"]
    line = refused(capsys, "export", recordings["mav"], "--format", "tum", *out)
    assert "holds the MAV, not the ground robot" in line
    line = refused(capsys, "export", recordings["ground"], "--format", "euroc", *out)
    assert "holds the ground robot, not the MAV" in line
    line = refused(capsys, "render", recordings["mav"], "--add", "lidar", *out)
    assert "holds the MAV, not the ground robot" in line


@pytest.mark.parametrize("name", ["mcap", "nerfstudio", "colmap", "webdataset"])
def test_by_default_a_format_holds_the_robot_that_is_there(
    recordings: dict[Robot, Path], name: str
) -> None:
    for robot in ROBOTS:
        assert robots_in(Simulated.open(recordings[robot]), name, None) == (robot,)


def test_exports_are_those_of_a_recording_of_both(
    recordings: dict[Robot, Path], exported, tmp_path: Path
) -> None:
    for robot, name in (("mav", "euroc"), ("ground", "tum")):
        out = tmp_path / name
        words = ["export", str(recordings[robot]), "--format", name, "--out", str(out)]
        assert cli.answer(words) is None
        files = [path.relative_to(out) for path in out.rglob("*") if path.is_file()]
        assert len(files) > IMAGES
        for file in files:
            assert (out / file).read_bytes() == (exported(name) / file).read_bytes(), file
    out = tmp_path / "colmap"
    words = ["export", str(recordings["mav"]), "--format", "colmap", "--out", str(out)]
    assert cli.answer(words) is None


@pytest.mark.parametrize("robot", ROBOTS)
def test_it_is_inspected_and_drawn(
    recordings: dict[Robot, Path],
    robot: Robot,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    page = tmp_path / "page.html"
    words = ["inspect", str(recordings[robot]), "--page", str(page)]
    assert cli.answer(words) == console.EXIT_OK
    assert f"{NAMES[robot]} alone" in " ".join(capsys.readouterr().out.split())
    text = page.read_text()
    assert f"{NAMES[robot]} alone" in text
    drawn = [one for one in ROBOTS if f"{NAMES[one]}, 0.0 s" in text]  # an image's caption
    assert drawn == [robot]


def test_track_takes_the_robot_that_is_there(recordings: dict[Robot, Path], tmp_path: Path) -> None:
    words = ["track", str(recordings["ground"]), "--front-end", "opencv"]
    assert cli.answer([*words, "--out", str(tmp_path / "out")]) is None
    lines = (tmp_path / "out" / "trajectory.tum").read_text().splitlines()
    assert len(lines) >= IMAGES
    assert len(open_robot(recordings["mav"], Source.MAV).camera_stamps) == IMAGES


def test_what_is_rendered_is_of_the_robot_that_is_there(
    recordings: dict[Robot, Path], tmp_path: Path
) -> None:
    words = ["render", str(recordings["mav"]), "--add", "depth,stereo", "--every", "10"]
    words += ["--scene", str(recordings["mav"].with_name("small.toml"))]
    assert cli.answer([*words, "--out", str(tmp_path / "out")]) is None
    made = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert made == ["mav_depth", "mav_stereo"]


@pytest.mark.parametrize(
    "words", [["--seeds", "0-1"], ["--level", "easy"], ["--sealed", "truth"]], ids=lambda w: w[0]
)
def test_data_of_both_robots_cannot_be_of_one(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = [] if words[0] == "--level" else ["tiny"]
    line = refused(capsys, "simulate", *scene, "--only", "mav", *words, "--out", tmp_path / "out")
    assert "--only mav: for one recording, not with --seeds, --level or --sealed" in line
    assert list(tmp_path.iterdir()) == []


def test_the_size_is_that_of_one_robot() -> None:
    assert on_disk(10.0, only="mav") == "about 60 MB"
    assert on_disk(10.0, only="ground") == "about 200 MB"
    assert on_disk(10.0, every=2, only="mav") == "about 30 MB"
