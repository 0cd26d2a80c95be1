"""Links that lead out of a recording's folder are refused; others are followed."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from airground.core.cloud import Source
from airground.errors import InputError
from airground.io.folder_links import FOLLOW_LINKS, check_links
from airground.io.open_recording import open_robot
from evaluation.judge.score.submission import read_submission
from sim.recording.truth import Truth
from tests.fuzz.folders import make_recording, make_seven_scenes
from tests.io.plain_folders import write_euroc, write_tum
from tests.io.recordings import write_recording
from tests.io.test_ros_bags import flying


def _seven_scenes(folder: Path) -> Path:
    folder.mkdir()
    make_seven_scenes(folder)
    return folder / "seq-01"


LAYOUTS: dict[str, tuple[Callable[[Path], Path], Source, str]] = {
    "ours": (write_recording, Source.MAV, "mav0/cam0/data/50000000.png"),
    "ours, the samples": (write_recording, Source.MAV, "mav0/imu0/data.csv"),
    "EuRoC": (write_euroc, Source.MAV, "mav0/cam0/sensor.yaml"),
    "TUM RGB-D": (lambda at: write_tum(at, (640, 480)), Source.GROUND, "depth.txt"),
    "7-Scenes": (_seven_scenes, Source.GROUND, "frame-000008.depth.png"),
    "a folder of ROS 2": (lambda at: flying(False).write(at), Source.MAV, "metadata.yaml"),
}


@pytest.fixture(autouse=True)
def _nothing_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FOLLOW_LINKS, raising=False)


def opened(folder: Path, robot: Source) -> object:
    calibration = folder.parent / "camera.yaml"
    return open_robot(folder, robot, calibration if calibration.exists() else None)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_link_out_of_the_folder_is_refused_unless_allowed(
    layout: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    make, robot, name = LAYOUTS[layout]
    folder = make(tmp_path / "fr1_desk" if "TUM" in layout else tmp_path / "recording")
    file, elsewhere = folder / name, tmp_path / "elsewhere"
    file.rename(elsewhere)
    file.symlink_to(elsewhere)
    with pytest.raises(InputError) as caught:
        opened(folder, robot)
    said = str(caught.value)
    assert re.search(rf"{re.escape(name)}: is a link to {elsewhere}, which lies outside", said)
    assert f"{FOLLOW_LINKS}=1" in said
    assert "\n" not in said
    monkeypatch.setenv(FOLLOW_LINKS, "1")
    opened(folder, robot)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_links_within_the_folder_and_to_it_are_followed(layout: str, tmp_path: Path) -> None:
    make, robot, name = LAYOUTS[layout]
    folder = make(tmp_path / "fr1_desk" if "TUM" in layout else tmp_path / "recording")
    file = folder / name
    kept = file.with_name(f"kept{file.suffix}")
    file.rename(kept)
    file.symlink_to(kept if file.suffix == ".png" else kept.name)  # absolute, and relative
    if "ROS" not in layout:  # where every name is a file of the bag
        (folder / "all").symlink_to(".")
    (folder.parent / "link").symlink_to(folder)
    opened(folder, robot)
    if "TUM" not in layout:  # whose calibration is known by the folder's name
        opened(folder.parent / "link", robot)


@pytest.mark.parametrize(
    "target", ["../secret", "/etc/passwd", "..", "/", "../absent", "data/../../secret", "loop"]
)
def test_whatever_a_link_leads_to_is_found(target: str, tmp_path: Path) -> None:
    (tmp_path / "secret").touch()
    (tmp_path / "folder" / "data").mkdir(parents=True)
    (tmp_path / "folder" / "loop").symlink_to("../out")
    (tmp_path / "out").symlink_to("secret")
    (tmp_path / "folder" / "data" / "link").symlink_to(
        target if target[0] in "/d" else f"../{target}"
    )
    with pytest.raises(InputError, match="is a link to"):
        check_links(tmp_path / "folder")


def test_a_neighbour_with_a_longer_name_is_outside(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder2").mkdir()
    (tmp_path / "folder" / "link").symlink_to("../folder2")
    with pytest.raises(InputError, match="outside"):
        check_links(tmp_path / "folder")


def test_a_submission_cannot_hand_in_the_truth(tmp_path: Path) -> None:
    (tmp_path / "truth").mkdir()
    (tmp_path / "truth" / "mav.tum").write_text("0.1 0 0 0 0 0 0 1\n")
    (tmp_path / "submission").mkdir()
    (tmp_path / "submission" / "0001.tum").symlink_to("../truth/mav.tum")
    with pytest.raises(InputError, match=r"0001\.tum: is a link to"):
        read_submission(tmp_path / "submission", {"0001"})


def test_truth_without_its_recording_is_checked_too(tmp_path: Path) -> None:
    make_recording(tmp_path)
    motion = tmp_path / "recording" / "truth" / "motion.npz"
    motion.rename(tmp_path / "motion.npz")
    motion.symlink_to(tmp_path / "motion.npz")
    with pytest.raises(InputError, match=r"motion\.npz: is a link to"):
        Truth.open(tmp_path / "recording")


def test_another_value_of_the_variable_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(FOLLOW_LINKS, "yes")
    with pytest.raises(InputError, match=f"{FOLLOW_LINKS}: expected 1 or 0, got 'yes'"):
        check_links(tmp_path)
