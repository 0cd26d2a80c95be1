"""What airground reads: for each kind of input a good one, and what the commands do with it."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date
from importlib import resources
from pathlib import Path

import numpy as np

from airground.config import Config
from airground.core.cloud import PointCloud
from airground.io.input_files import SETTINGS_LIMIT, read_bytes
from airground.io.ply import read_ply, write_ply
from airground.io.tum import read_tum
from evaluation.datasets.plan import Plan
from evaluation.judge.accepted import Accepted, Measured
from evaluation.judge.results import CONFIG, SHOWCASE, SUMMARY, TABLE, merged, read_results
from evaluation.judge.runs import against, read_runs
from evaluation.judge.summary import RunInfo, build_summary
from evaluation.judge.verdict import compare
from evaluation.measure.plans.dials import Subject as DialSubject
from evaluation.measure.plans.dials import turned
from evaluation.measure.plans.sweep import parse_vary, points
from evaluation.measure.work.batch_system import read_jobs
from evaluation.run.given_map import read_map
from evaluation.setup.checked_json import read_checked
from evaluation.setup.settings import EVALUATOR_SECTIONS, resolve, resolve_all, write_config
from evaluation.show.comparison.verdict_table import junit, markdown
from sim.robots.motion import simulate_motion
from sim.scene import load_scene
from sim.sensors.presets import sensor_preset
from sim.world.world import build_world
from tests.evaluation.judge.flights import make_results
from tests.evaluation.synthetic_results import make_showcase
from tests.fuzz.folders import (
    make_bags,
    make_euroc,
    make_recording,
    make_seven_scenes,
    make_tum,
    read_bags,
    read_euroc,
    read_recording,
    read_rgbd,
    update_digest,
    work_on_bags,
    work_on_euroc,
    work_on_recording,
    work_on_rgbd,
)
from tests.fuzz.harmless import KEPT
from tests.fuzz.submissions import make_submission, read_scored, work_on_scored


@dataclass(frozen=True)
class Subject:
    """A kind of input.

    Attributes:
        make: Writes a good one into an empty folder.
        read: Reads all of it from that folder, and returns that; the second folder takes what is
            written.
        work: Does with it what the commands do, which takes longer.
        weight: How often it is chosen, relative to the others.
        settle: Brings what an input states of a changed file up to date.
    """

    make: Callable[[Path], object]
    read: Callable[[Path, Path], object]
    work: Callable[[Path, Path], object]
    weight: int = 1
    settle: Callable[[Path, Path], object] = lambda folder, path: None


BODY = """
[[bodies]]
name = "walker"
start_s = 2.0
speed_mps = 0.8
waypoints = [[-1.0, 2.0], [1.0, 2.0], [1.5, -2.0]]
"""


def make_scenes(folder: Path) -> None:
    for name in ("flat", "tiny", "outdoor", "paper_b", "warehouse", "collapsed", "street"):
        text = resources.files("scenes").joinpath(f"{name}.toml").read_text(encoding="utf-8")
        (folder / f"{name}.toml").write_text(text + (BODY if name == "tiny" else ""))


def read_scenes(folder: Path, out: Path) -> object:
    files = sorted(file for file in folder.iterdir() if file.name != KEPT)
    return [load_scene(str(file)) for file in files]


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


def read_settings(folder: Path, out: Path) -> object:
    """As every verb with `--config`, `--set`, `--vary` and `--cluster`."""
    config = resolve(file=folder / "config.toml")
    write_config(config, out / "config.toml")
    words = _words(folder / "words.txt")
    settings = resolve_all(overrides=words, sections=EVALUATOR_SECTIONS)
    vary = _words(folder / "vary.txt")
    start = DialSubject(load_scene("flat"), sensor_preset("nominal"), settings.pipeline())
    subjects = [turned(start, point) for point in points(parse_vary(vary))]
    return config, words, vary, [one.scene for one in subjects], read_jobs(folder / "jobs.yaml")


def _words(file: Path) -> list[str]:
    """Words of a command line, from a file: as they come from a shell, whatever their bytes."""
    return read_bytes(file, SETTINGS_LIMIT).decode(errors="surrogateescape").splitlines()


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


def read_run(folder: Path, out: Path) -> object:
    """As `airground evaluate`, without drawing."""
    results = merged([read_results(folder / "first"), read_results(folder / "second")])
    run = RunInfo.here(0)
    summaries = [
        build_summary(results.table, condition, run) for condition in results.table.conditions()
    ]
    for summary in summaries:
        summary.write(out / SUMMARY)
    accepted = Accepted.read(folder / "accepted.json")
    accepted.measured()
    return summaries, accepted, results.showcase


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


def read_clouds(folder: Path, out: Path) -> object:
    """As `--ground-map`, `--trajectory` and `inspect` of a dataset."""
    cloud, sources = read_ply(folder / "cloud.ply")
    write_ply(out / "cloud.ply", cloud, sources)
    maps = [read_map(folder / f"{name}.ply") for name in ("map", "mesh")]
    poses = read_tum(folder / "poses.tum")
    plan = read_checked(Plan, folder / "dataset.json", "plan of a dataset")
    return cloud, sources, maps, poses, plan


SUBJECTS: dict[str, Subject] = {
    "recording with truth": Subject(
        make_recording, read_recording, work_on_recording, 3, update_digest
    ),
    "EuRoC folder": Subject(make_euroc, read_euroc, work_on_euroc, 2),
    "TUM RGB-D folder": Subject(make_tum, read_rgbd("tum"), work_on_rgbd("tum"), 2),
    "7-Scenes folder": Subject(make_seven_scenes, read_rgbd("seq-01"), work_on_rgbd("seq-01")),
    "ROS 1 bags": Subject(make_bags(True), read_bags, work_on_bags),
    "ROS 2 bags (MCAP)": Subject(make_bags(False), read_bags, work_on_bags),
    "scenes": Subject(make_scenes, read_scenes, work_on_scenes, 2),
    "settings": Subject(make_settings, read_settings, read_settings, 2),
    "results": Subject(make_run, read_run, work_on_run, 2),
    "clouds, poses, plans": Subject(make_clouds, read_clouds, read_clouds, 2),
    "submissions": Subject(make_submission, read_scored, work_on_scored),
}


def fresh(folder: Path) -> Path:
    """The folder, empty."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder
