"""A recording of a world that changes: each robot's images and truth are of the world it sees."""

import csv
import shutil
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from airground.errors import RecordingError
from airground.io.digests import path_digest
from airground.io.recording import Recording
from sim.geometry.edges import find_edges
from sim.recording import recorder
from sim.recording.pixel_truth import instance_ids, instances_of, pixel_truth
from sim.recording.recorder import record
from sim.recording.render import Renderer, with_cameras
from sim.recording.smooth_edges import smooth_edges
from sim.recording.truth import Truth
from sim.robots.motion import ROBOTS, Robot
from sim.scene import Scene, parse_scene
from sim.sensors.presets import NONE
from sim.world.world import World, build_world, flight_world
from tests.sim.small_flight import SCENE, few_stamps, unpainted

SEED = 3


def changing(share: float) -> Scene:
    scene = parse_scene(SCENE, "small.toml")
    rubble = scene.rubble.model_copy(update={"boxes": 8, "changed": share})
    return scene.model_copy(update={"rubble": rubble})


def plain_flight(drive: World, pictures: bool = True) -> World:
    return flight_world(drive, pictures=False)


@pytest.fixture(scope="module", autouse=True)
def _small_recordings() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", few_stamps)
        patch.setattr(recorder, "painted", unpainted)
        patch.setattr(recorder, "flight_world", plain_flight)
        yield


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("changed") / "recording"
    return record(changing(0.5), SEED, NONE, out, workers=1)


@pytest.fixture(scope="module")
def worlds() -> dict[Robot, World]:
    drive = build_world(changing(0.5), SEED, pictures=False)
    return {"ground": drive, "mav": flight_world(drive, pictures=False)}


def stamps(recording: Path, robot: Robot) -> list[int]:
    opened = Recording.open(recording)
    sensed = opened.mav if robot == "mav" else opened.ground
    return [int(stamp) for stamp in sensed.camera_stamps]


@pytest.mark.parametrize("robot", ROBOTS)
def test_truth_is_that_of_the_world_that_a_robot_sees(
    recorded: Path, worlds: dict[Robot, World], robot: Robot
) -> None:
    """Depth by rays against the stored surface is what the renderer draws."""
    truth, world = Truth.open(recorded), worlds[robot]
    camera = truth.lens(robot).pinhole()
    with Renderer(with_cameras(world.spec, {robot: camera})) as renderer:
        for stamp in stamps(recorded, robot):
            _, drawn = renderer.draw(robot, truth.T_world_camera(robot, stamp))
            true = truth.depth(robot, stamp)
            both = np.isfinite(true) & np.isfinite(drawn)
            assert both.mean() > 0.5
            assert np.quantile(np.abs(true - drawn)[both], 0.995) < 2e-3


def test_the_mavs_images_show_the_changed_world(recorded: Path, worlds: dict[Robot, World]) -> None:
    truth, recording, world = Truth.open(recorded), Recording.open(recorded), worlds["mav"]
    camera, stamp = truth.lens("mav").pinhole(), stamps(recorded, "mav")[-1]
    pose = truth.T_world_camera("mav", stamp)
    edges = find_edges((world.vertices, world.triangles))
    with Renderer(with_cameras(world.spec, {"mav": camera})) as renderer:
        colour, depth = renderer.draw("mav", pose)
    grey = np.asarray(cv2.cvtColor(colour, cv2.COLOR_RGB2GRAY), np.uint8)[..., None]
    shown = smooth_edges(grey, depth, camera, pose, edges)[..., 0]
    np.testing.assert_array_equal(
        recording.mav.read_image(len(stamps(recorded, "mav")) - 1).image, shown
    )


def test_the_list_of_changes_leads_from_one_surface_to_the_other(recorded: Path) -> None:
    truth = Truth.open(recorded)
    with (truth.folder / "changes.csv").open() as file:
        rows = list(csv.DictReader(file))
    with (truth.folder / "boxes.csv").open() as file:
        boxes = {row["name"]: row for row in csv.DictReader(file)}
    assert len(rows) == 4
    for row in rows:
        before, after = (
            np.array([float(row[f"t{axis} [m] {when}"] or np.nan) for axis in "xyz"])
            for when in ("before", "after")
        )
        listed = [float(boxes[row["name"]][f"t{axis} [m]"]) for axis in "xyz"]
        np.testing.assert_array_equal(before, listed)
        assert np.isnan(after).any() == (row["change"] == "gone")
    seen = {robot: {part.name for part in truth.surface(robot).parts} for robot in ROBOTS}
    gone = {row["name"] for row in rows if row["change"] == "gone"}
    assert seen["ground"] - seen["mav"] == gone
    assert seen["mav"] < seen["ground"] or not gone


def test_a_thing_has_the_same_id_for_both_robots(recorded: Path) -> None:
    truth = Truth.open(recorded)
    ground, mav = (instances_of(truth, robot) for robot in ("ground", "mav"))
    assert ground.names == mav.names
    seen = pixel_truth(truth, "mav", stamps(recorded, "mav")[-1])
    shown = {mav.names[index - 1] for index in np.unique(instance_ids(seen, mav)) if index}
    assert shown <= {part.name for part in truth.surface("mav").parts}


def test_a_missing_surface_of_the_mav_is_reported(recorded: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(recorded, tmp_path / "copy")
    (copy / "truth/surface_mav.ply").unlink()
    with pytest.raises(RecordingError, match=r"surface_mav\.ply: cannot be read: No such file"):
        _ = Truth.open(copy).surface("mav").mesh


def test_without_changes_the_recording_is_what_it_was(tmp_path: Path) -> None:
    out = record(changing(0.0), SEED, NONE, tmp_path / "same", workers=1)
    assert not list((out / "truth").glob("*_mav.*"))
    assert not (out / "truth/changes.csv").exists()
    truth = Truth.open(out)
    assert truth.surface("mav") is truth.surface("ground")


@pytest.mark.slow
def test_any_number_of_workers_gives_the_same_bytes(recorded: Path, tmp_path: Path) -> None:
    again = record(changing(0.5), SEED, NONE, tmp_path / "again", workers=2)
    files = sorted(path for path in recorded.rglob("*") if path.is_file())
    assert not [path for path in files if path.suffix in (".mjb",) or path.name.startswith("edges")]
    for path in files:
        assert path_digest(path) == path_digest(again / path.relative_to(recorded))
