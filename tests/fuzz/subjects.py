"""What airground reads: for each kind of input a good one, and what the commands do with it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import date
from importlib import resources
from pathlib import Path

import cv2
import numpy as np

from airground.config import Config
from airground.core.cloud import PointCloud, Source
from airground.io.layout import TRUTH
from airground.io.open_recording import open_robot
from airground.io.ply import read_ply, write_ply
from airground.io.recording import Recording
from airground.io.tum import read_tum
from evaluation.datasets.formats import FORMATS, robots_for
from evaluation.datasets.inspection.inspect_dataset import inspect_dataset
from evaluation.datasets.plan import Plan
from evaluation.datasets.simulated import Simulated
from evaluation.judge.accepted import Accepted, Measured
from evaluation.judge.results import CONFIG, SHOWCASE, SUMMARY, TABLE, merged, read_results
from evaluation.judge.runs import against, read_runs
from evaluation.judge.summary import RunInfo, build_summary
from evaluation.judge.verdict import compare
from evaluation.measure.plans.dials import Subject as DialSubject
from evaluation.measure.plans.dials import turned
from evaluation.measure.plans.sweep import parse_vary, points
from evaluation.measure.work.batch_system import read_jobs
from evaluation.run.drops import DropList, nothing_dropped
from evaluation.run.front_ends import named_front_end
from evaluation.run.given_map import read_map
from evaluation.run.own_recordings import run_alone, write_alone
from evaluation.setup.checked_json import read_checked
from evaluation.setup.settings import EVALUATOR_SECTIONS, resolve, resolve_all, write_config
from evaluation.show.comparison.verdict_table import junit, markdown
from evaluation.table.true_camera import true_camera
from sim.geometry.parts import read_parts
from sim.recording.truth import Truth, write_truth
from sim.robots.motion import ROBOTS, Motion, simulate_motion
from sim.robots.robot_motion import ARRAY_NAMES
from sim.scene import load_scene, parse_scene
from sim.sensors.presets import sensor_preset
from sim.world.world import build_world
from tests.evaluation.judge.flights import make_results
from tests.evaluation.synthetic_results import make_showcase
from tests.io.plain_folders import CAMERA_YAML, camera_stamps, tum_image, write_euroc, write_tum
from tests.io.recordings import SAMPLE_STAMPS, calibration, write_recording
from tests.io.test_ros_bags import driving, flying
from tests.sim.small_flight import SCENE


@dataclass(frozen=True)
class Subject:
    """A kind of input.

    Attributes:
        make: Writes a good one into an empty folder.
        read: Reads all of it from that folder; the second folder takes what is written.
        work: Does with it what the commands do, which takes longer.
        weight: How often it is chosen, relative to the others.
    """

    make: Callable[[Path], object]
    read: Callable[[Path, Path], object]
    work: Callable[[Path, Path], object]
    weight: int = 1


def track(path: Path, robot: Source, out: Path, calibration_file: Path | None = None) -> None:
    """As `airground track`."""
    recording = open_robot(path, robot, calibration_file)
    true_pose = true_camera(recording)
    front_end = named_front_end(recording, "slam", Config(), np.random.default_rng(0), None)
    write_alone(out, recording, "slam", run_alone(recording, front_end), true_pose)


def read_robot(path: Path, robot: Source, calibration_file: Path | None = None) -> None:
    """All samples and images, and the true poses where there are any."""
    recording = open_robot(path, robot, calibration_file)
    for _ in recording.messages():
        pass
    true_pose = true_camera(recording)
    if true_pose is not None:
        true_pose(int(recording.camera_stamps[1]))


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


def read_recording(folder: Path, out: Path) -> None:
    root = folder / "recording"
    recording = Recording.open(root)
    for _ in recording.messages():
        pass
    DropList.read(folder / "dropped.json", recording)
    truth = Truth.open(root)
    truth.T_world_mav_camera(int(recording.mav.camera_stamps[1]))
    truth.depth("ground", int(recording.ground.camera_stamps[0]))
    read_parts(root / TRUTH / "parts.csv")
    Simulated.open(root)


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


def read_euroc(folder: Path, out: Path) -> None:
    read_robot(folder / "euroc", Source.MAV)
    read_robot(folder / "euroc", Source.MAV, folder / "camera.yaml")


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


def read_rgbd(name: str) -> Callable[[Path, Path], None]:
    def read(folder: Path, out: Path) -> None:
        read_robot(folder / name, Source.GROUND, folder / "camera.yaml")

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


def read_bags(folder: Path, out: Path) -> None:
    for name, robot in (("mav", Source.MAV), ("ground", Source.GROUND)):
        read_robot(bag(folder, name), robot)


def work_on_bags(folder: Path, out: Path) -> None:
    for name, robot in (("mav", Source.MAV), ("ground", Source.GROUND)):
        inspect_dataset(bag(folder, name))
        track(bag(folder, name), robot, out)


def bag(folder: Path, name: str) -> Path:
    return next(iter(sorted(folder.glob(f"{name}*"))), folder / name)


def make_scenes(folder: Path) -> None:
    for name in ("flat", "tiny", "outdoor", "paper_b"):
        text = resources.files("scenes").joinpath(f"{name}.toml").read_text(encoding="utf-8")
        (folder / f"{name}.toml").write_text(text)


def read_scenes(folder: Path, out: Path) -> None:
    for file in sorted(folder.iterdir()):
        load_scene(str(file))


def work_on_scenes(folder: Path, out: Path) -> None:
    """As `airground simulate` up to the first image, for the scene of which that is cheap."""
    read_scenes(folder, out)
    scene = load_scene(str(folder / "flat.toml"))
    simulate_motion(build_world(scene, 0, pictures=False), scene, 0, 9.0)


WORDS = (
    "localization.particles=50",
    "localization.heading=search",
    "oracle.noise_mm=2",
    "fusion.iterations=20",
)


def make_settings(folder: Path) -> None:
    write_config(Config(), folder / "config.toml")
    (folder / "words.txt").write_text("\n".join(WORDS) + "\n")
    (folder / "vary.txt").write_text("localization.particles=50,200\nscene.texture=0.5,1\n")
    lines = "{slurm: {cores: 2, processes: 2, memory: 4GB, walltime: 01:00:00}}"
    (folder / "jobs.yaml").write_text(f"jobqueue: {lines}\njobs: 3\n")


def read_settings(folder: Path, out: Path) -> None:
    """As every verb with `--config`, `--set`, `--vary` and `--cluster`."""
    write_config(resolve(file=folder / "config.toml"), out / "config.toml")
    words = (folder / "words.txt").read_text(errors="surrogateescape").splitlines()
    settings = resolve_all(overrides=words, sections=EVALUATOR_SECTIONS)
    vary = (folder / "vary.txt").read_text(errors="surrogateescape").splitlines()
    start = DialSubject(load_scene("flat"), sensor_preset("nominal"), settings.pipeline())
    for point in points(parse_vary(vary)):
        turned(start, point)
    read_jobs(folder / "jobs.yaml")


def make_run(folder: Path) -> None:
    """Two small runs, and figures accepted from one of them."""
    showcase = folder / "first" / SHOWCASE
    for name, seeds in (("first", range(3)), ("second", range(3, 6))):
        out = folder / name
        out.mkdir()
        table = make_results(seeds)
        table.write(out / TABLE)
        write_config(Config(), out / CONFIG)
        build_summary(table, table.conditions()[0], RunInfo.here(0)).write(out / SUMMARY)
    make_showcase(scale=1).save(showcase)
    measured = Measured.of(make_results(range(3)))
    accepted = Accepted.of(measured, "abc", "first", None, date(2024, 5, 17))
    accepted.write(folder / "accepted.json")


def read_run(folder: Path, out: Path) -> None:
    """As `airground evaluate`, without drawing."""
    results = merged([read_results(folder / "first"), read_results(folder / "second")])
    for condition in results.table.conditions():
        build_summary(results.table, condition, RunInfo.here(0)).write(out / SUMMARY)
    Accepted.read(folder / "accepted.json").measured()


def work_on_run(folder: Path, out: Path) -> None:
    """As `airground evaluate`, `compare`, `check` and `accept`, without drawing."""
    read_run(folder, out)
    results = read_results(folder / "first")
    results.table.write(out / TABLE)
    if results.showcase is not None:
        results.showcase.save(out / SHOWCASE)
    reference, run = read_runs([folder / "first", folder / "second"])
    against(reference, run).caveats()
    accepted = Accepted.read(folder / "accepted.json")
    before = accepted.measured()
    comparison = compare(before, Measured.of(results.table, before.condition))
    markdown(comparison), junit(comparison)
    Accepted.of(run.measured, "def", "second", accepted, date(2024, 5, 18)).write(out / "a.json")


def make_clouds(folder: Path) -> None:
    """A cloud, a map of others, a trajectory, the plan of a dataset."""
    rng = np.random.default_rng(0)
    points_m = rng.normal(0, 1, (50, 3)).astype(np.float32)
    normals = np.tile(np.float32([0, 0, 1]), (50, 1))
    cloud = PointCloud(points_m, rng.integers(0, 256, (50, 3)).astype(np.uint8), normals)
    write_ply(folder / "cloud.ply", cloud, np.zeros(50, np.uint8))
    write_ply(folder / "map.ply", cloud)
    rows = ["ply", "format ascii 1.0", "element vertex 3"]
    rows += [f"property double {axis}" for axis in "xyz"] + ["element face 1"]
    rows += ["property list uchar int vertex_indices", "end_header", "0 0 0", "1 0 0", "0 1 0"]
    (folder / "mesh.ply").write_text("\n".join([*rows, "3 0 1 2"]) + "\n")
    lines = [f"{n / 30:.9f} {n / 100} 0 0 0 0 0 1" for n in range(60)]
    (folder / "poses.tum").write_text("\n".join(["# poses", *lines]) + "\n")
    world = {"scene": "tiny", "name": "tiny", "digest": "0" * 64, "seed": 1, "part": "train"}
    plan = {"airground": "0.1.0", "sensors": "nominal", "duration_s": None, "worlds": [world]}
    (folder / "dataset.json").write_text(json.dumps(plan))


def read_clouds(folder: Path, out: Path) -> None:
    """As `--ground-map`, `--trajectory` and `inspect` of a dataset."""
    cloud, sources = read_ply(folder / "cloud.ply")
    write_ply(out / "cloud.ply", cloud, sources)
    for name in ("map", "mesh"):
        read_map(folder / f"{name}.ply")
    read_tum(folder / "poses.tum")
    read_checked(Plan, folder / "dataset.json", "plan of a dataset")


SUBJECTS: dict[str, Subject] = {
    "recording with truth": Subject(make_recording, read_recording, work_on_recording, 3),
    "EuRoC folder": Subject(make_euroc, read_euroc, work_on_euroc, 2),
    "TUM RGB-D folder": Subject(make_tum, read_rgbd("tum"), work_on_rgbd("tum"), 2),
    "7-Scenes folder": Subject(make_seven_scenes, read_rgbd("seq-01"), work_on_rgbd("seq-01")),
    "ROS 1 bags": Subject(make_bags(True), read_bags, work_on_bags),
    "ROS 2 bags (MCAP)": Subject(make_bags(False), read_bags, work_on_bags),
    "scenes": Subject(make_scenes, read_scenes, work_on_scenes, 2),
    "settings": Subject(make_settings, read_settings, read_settings, 2),
    "results": Subject(make_run, read_run, work_on_run, 2),
    "clouds, poses, plans": Subject(make_clouds, read_clouds, read_clouds, 2),
}


def fresh(folder: Path) -> Path:
    """The folder, empty."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder
