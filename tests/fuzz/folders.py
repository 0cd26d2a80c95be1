"""Folders and bags of robots: good ones, and what the commands do with them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from airground.config import Config
from airground.core.cloud import Source
from airground.io.digests import path_digest
from airground.io.header import read_header, write_toml
from airground.io.layout import HEADER, TRUTH
from airground.io.open_recording import open_robot
from airground.io.recording import Recording
from evaluation.datasets.formats import FORMATS, robots_for
from evaluation.datasets.inspection.inspect_dataset import inspect_dataset
from evaluation.datasets.simulated import Simulated
from evaluation.run.drops import DropList, nothing_dropped
from evaluation.run.front_ends import named_front_end
from evaluation.run.own_recordings import run_alone, write_alone
from evaluation.table.true_camera import true_camera
from sim.geometry.parts import read_parts
from sim.recording.truth import Truth, write_truth
from sim.robots.motion import ROBOTS, Motion, simulate_motion
from sim.robots.robot_motion import ARRAY_NAMES
from sim.scene import parse_scene
from sim.world.world import build_world
from tests.io.plain_folders import CAMERA_YAML, camera_stamps, tum_image, write_euroc, write_tum
from tests.io.recordings import SAMPLE_STAMPS, calibration, write_recording
from tests.io.test_ros_bags import driving, flying
from tests.sim.small_flight import SCENE


def track(path: Path, robot: Source, out: Path, calibration_file: Path | None = None) -> None:
    """As `airground track`."""
    recording = open_robot(path, robot, calibration_file)
    true_pose = true_camera(recording)
    front_end = named_front_end(recording, "slam", Config(), np.random.default_rng(0), None)
    write_alone(out, recording, "slam", run_alone(recording, front_end), true_pose)


def read_robot(path: Path, robot: Source, calibration_file: Path | None = None) -> object:
    """All samples and images, and the true poses where there are any."""
    recording = open_robot(path, robot, calibration_file)
    messages = list(recording.messages())
    true_pose = true_camera(recording)
    last = None if true_pose is None else true_pose(int(recording.camera_stamps[-1]))
    return recording.calibration, messages, recording.T_pose_camera, recording.assumed, last


def make_recording(folder: Path) -> None:
    """Four images a robot, with the truth of a flight over a plain floor."""
    root = write_recording(folder / "recording")
    scene = parse_scene(SCENE, "small.toml")
    world = build_world(scene, 0, pictures=False)
    motion = simulate_motion(world, scene, 0)
    start = first_samples(motion, len(SAMPLE_STAMPS))
    write_truth(root, world, world, start, calibration())
    recording = Recording.open(root)
    nothing_dropped(recording).write(folder / "dropped.json")


def first_samples(motion: Motion, count: int) -> Motion:
    """The start of a motion."""
    robots = {
        name: replace(
            motion.robot(name),
            **{key: getattr(motion.robot(name), key)[:count] for key in ARRAY_NAMES},
        )
        for name in ROBOTS
    }
    return Motion(stamps_ns=motion.stamps_ns[:count], **robots)


def read_recording(folder: Path, out: Path) -> object:
    root = folder / "recording"
    recording = Recording.open(root)
    messages = list(recording.messages())
    dropped = DropList.read(folder / "dropped.json", recording)
    truth = Truth.open(root)
    pose = truth.T_world_mav_camera(int(recording.mav.camera_stamps[1]))
    depth = truth.depth("ground", int(recording.ground.camera_stamps[0]))
    parts = read_parts(root / TRUTH / "parts.csv")
    Simulated.open(root)
    facts = recording.header.model_dump(exclude={"digests"})
    return facts, messages, dropped, truth.calibration, pose, depth, parts


def update_digest(folder: Path, path: Path) -> None:
    """The header's digest of a file that was changed, or of its folder."""
    root = folder / "recording"
    header = read_header(root / HEADER)
    for name in header.digests:
        if root / name in (path, path.parent):
            digests = header.digests | {name: path_digest(root / name)}
            write_toml(root / HEADER, header.model_copy(update={"digests": digests}))


def work_on_recording(folder: Path, out: Path) -> None:
    """As `airground inspect`, `track`, `run --drops` and `export`."""
    root = folder / "recording"
    inspect_dataset(root)
    DropList.read(folder / "dropped.json", Recording.open(root))
    for robot in (Source.MAV, Source.GROUND):
        track(root, robot, out)
    for name in ("tum", "euroc"):
        (out / name).mkdir()
        FORMATS[name].write(out / name, Simulated.open(root), robots_for(name, None))


def make_euroc(folder: Path) -> None:
    root = write_euroc(folder / "euroc")
    truth = root / "mav0" / "state_groundtruth_estimate0"
    truth.mkdir()
    rows = [f"{stamp},0.{n},1,2,1,0,0,0" for n, stamp in enumerate(camera_stamps())]
    (truth / "data.csv").write_text("\n".join(["#timestamp", *rows]) + "\n")
    (folder / "camera.yaml").write_text(CAMERA_YAML)


def read_euroc(folder: Path, out: Path) -> object:
    root = folder / "euroc"
    return [read_robot(root, Source.MAV, file) for file in (None, folder / "camera.yaml")]


def work_on_euroc(folder: Path, out: Path) -> None:
    inspect_dataset(folder / "euroc")
    track(folder / "euroc", Source.MAV, out, folder / "camera.yaml")


def make_tum(folder: Path) -> None:
    """Of small images, with their calibration beside it."""
    root = write_tum(folder / "tum", (64, 48))
    rows = [f"1305031102.{n}753 0.{n} 1 2 0 0 0 1" for n in range(1, 4)]
    (root / "groundtruth.txt").write_text("\n".join(rows) + "\n")
    (folder / "camera.yaml").write_text(CAMERA_YAML)


def make_seven_scenes(folder: Path) -> None:
    root = folder / "seq-01"
    root.mkdir()
    for number in range(7, 11):
        name = f"{root}/frame-{number:06d}"
        cv2.imwrite(f"{name}.color.png", tum_image("rgb", number, 64, 48))
        cv2.imwrite(f"{name}.depth.png", tum_image("depth", number, 64, 48) // 5)
        rows = ["1 0 0 0", "0 1 0 0.5", f"0 0 1 0.{number}", "0 0 0 1"]
        Path(f"{name}.pose.txt").write_text("\n".join(rows) + "\n")
    (folder / "camera.yaml").write_text(CAMERA_YAML)


def read_rgbd(name: str) -> Callable[[Path, Path], object]:
    def read(folder: Path, out: Path) -> object:
        return read_robot(folder / name, Source.GROUND, folder / "camera.yaml")

    return read


def work_on_rgbd(name: str) -> Callable[[Path, Path], None]:
    def work(folder: Path, out: Path) -> None:
        calibration_file = folder / "camera.yaml"
        inspect_dataset(
            folder / name, lambda path, robot: open_robot(path, robot, calibration_file)
        )
        track(folder / name, Source.GROUND, out, calibration_file)

    return work


def make_bags(ros1: bool) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        suffix = ".bag" if ros1 else ""
        flying(ros1).write(folder / f"mav{suffix}")
        driving(ros1).write(folder / f"ground{suffix}")

    return make


def read_bags(folder: Path, out: Path) -> object:
    robots = ("mav", Source.MAV), ("ground", Source.GROUND)
    return [read_robot(bag(folder, name), robot) for name, robot in robots]


def work_on_bags(folder: Path, out: Path) -> None:
    for name, robot in (("mav", Source.MAV), ("ground", Source.GROUND)):
        inspect_dataset(bag(folder, name))
        track(bag(folder, name), robot, out)


def bag(folder: Path, name: str) -> Path:
    return next(iter(sorted(folder.glob(f"{name}*"))), folder / name)
