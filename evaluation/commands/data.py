"""Datasets made, checked, and written for others: `simulate`, `render`, `inspect`, `export`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from tyro.conf import Positional, UseAppendAction, arg

from airground.errors import InputError
from evaluation.commands.folder_options import FolderOptions
from evaluation.commands.options import (
    RENDER_S_PER_S,
    OutOption,
    SeedOption,
    SensorOption,
    Shown,
    Verb,
    in_megabytes,
    in_range,
    on_disk,
    render_s,
    work_s,
)
from evaluation.setup.console import EXIT_FAULT_FOUND, EXIT_OK


@dataclass(frozen=True, kw_only=True)
class DatasetOptions:
    """A dataset of many recordings."""

    heading: ClassVar[str] = "dataset of many recordings"

    seeds: Annotated[str | None, Shown("LIST")] = None
    """make a dataset with these seeds, as in 0-9 or 1,4,10-12"""
    split: Annotated[UseAppendAction[tuple[str, ...]], Shown("NAME=SHARE")] = ()
    """part with this share of the worlds (test=0.2); repeatable"""
    jobs: Annotated[int, Shown("N")] = 1
    """recordings made at a time"""


@dataclass(frozen=True, kw_only=True)
class BenchmarkOptions:
    """Data of a benchmark."""

    heading: ClassVar[str] = "benchmark (docs/score.md)"

    level: Annotated[
        Literal["paper", "easy", "medium", "hard", "extreme"] | None, Shown("NAME")
    ] = None
    """record flights of a level, over heaps that --seed draws, as 0001, 0002, ..."""
    flights: Annotated[int | None, Shown("N", "the level's own")] = None
    """with --level: flights over each of its scenes"""
    sealed: Annotated[Path | None, Shown("DIR")] = None
    """write the truth to this new folder, for score, and none into the recordings"""


@dataclass(frozen=True, kw_only=True)
class Simulate(BenchmarkOptions, DatasetOptions, SensorOption, SeedOption, OutOption, Verb):
    """Record what the robots' sensors see in a scene, or in many.

    The recording opens in tools that read EuRoC and TUM RGB-D; the truth is apart in truth/. With
    --seeds: a dataset of every scene with every seed, and its data sheet. With --level: the
    recordings of a benchmark. Both, given again after an interruption, make what is missing.
    """

    scenes: Annotated[Positional[tuple[str, ...]], Shown("SCENE ...")] = ()
    """scenes of the package (an unknown name lists them), or .toml files"""
    duration_s: Annotated[float | None, Shown("S", "the scene's own")] = None
    """length of the recording [s]"""
    flight: Annotated[int, Shown("N")] = 0
    """flight over the same heap: other waypoints, other noise"""
    dials: Annotated[UseAppendAction[tuple[str, ...]], arg(name="dial"), Shown("NAME=VALUE")] = ()
    """turn scene or sensors (docs/sweep.md), as in sensors.readout_ms=20; repeatable"""
    only: Annotated[Literal["mav", "ground"] | None, Shown("{mav,ground}", "both robots")] = None
    """record one robot alone, with the bytes that it has beside the other; for track, export,
    inspect and render"""

    def main(self) -> None:
        if self.duration_s is not None:
            in_range("--duration-s", self.duration_s, low=1.0)
        if self.only and (self.level or self.seeds or self.sealed):
            raise InputError(
                f"--only {self.only}: for one recording, not with --seeds, --level or --sealed"
            )
        if self.level is not None:
            self._make_benchmark(self.level)
        elif self.seeds is None:
            self._record_one()
        else:
            self._make_dataset(self.seeds)

    def _record_one(self) -> None:
        from airground.config import Config
        from airground.io.header import NAMES
        from evaluation.datasets.sealed import record_sealed
        from evaluation.measure.plans.dials import Subject, parse_dials, turned
        from evaluation.setup.output import check_free
        from evaluation.setup.progress import announce, step
        from sim.recording.recorder import Flight, record
        from sim.robots.motion import ROBOTS
        from sim.scene import load_scene
        from sim.sensors.presets import sensor_preset

        if len(self.scenes) != 1 or self.split or self.jobs != 1:
            raise InputError("one SCENE; several scenes, --split and --jobs: only with --seeds")
        if self.flights is not None:
            raise InputError("--flights: only with --level")
        dials = parse_dials(self.dials)
        asked = Subject(load_scene(self.scenes[0]), sensor_preset(self.sensors_name()), Config())
        subject, seed = turned(asked, dials), self.checked_seed()
        scene = subject.scene
        flight = int(in_range("--flight", self.flight))
        check_free(self.out)
        seconds, every = self.duration_s or scene.duration_s, subject.sensors.every
        expected_s = work_s(render_s(seconds, every, self.only), self.workers())
        who = f" of the {NAMES[self.only]} alone" if self.only else ""
        size = on_disk(seconds, every, self.only)
        announce(f"records {seconds:.0f} s{who} over {scene.name}, {size}", expected_s)
        if self.sealed is not None:
            asked_for = Flight(scene, seed, flight, subject.sensors, self.duration_s, dials)
            record_sealed(asked_for, self.out, self.sealed, self.workers())
            return
        with step("rendering", unit="images") as rendering:
            record(
                scene,
                seed,
                subject.sensors,
                self.out,
                self.duration_s,
                self.workers(),
                flight=flight,
                dials=dials,
                robots=(self.only,) if self.only else ROBOTS,
                progress=rendering.move_to,
            )

    def _make_dataset(self, seeds: str) -> None:
        from evaluation.datasets.collection import make_dataset
        from evaluation.datasets.plan import parse_seeds, parse_split, plan_dataset
        from evaluation.setup.progress import announce
        from sim.scene import load_scene

        if not self.scenes or self.seed is not None or self.flight or self.dials:
            raise InputError("--seeds: with at least one SCENE, no --seed, --flight or --dial")
        if self.sealed is not None or self.flights is not None:
            raise InputError("--seeds: without --sealed and --flights; --level makes a benchmark")
        split, sensors = parse_split(self.split), self.sensors_name()
        plan = plan_dataset(self.scenes, parse_seeds(seeds), split, sensors, self.duration_s)
        jobs = int(in_range("--jobs", self.jobs, low=1, high=1000))
        scenes = {scene: load_scene(scene) for scene in self.scenes}
        seconds = sum(self.duration_s or scenes[world.scene].duration_s for world in plan.worlds)
        expected_s = work_s(seconds * RENDER_S_PER_S, self.workers())
        what = f"records {len(plan.worlds)} worlds, {seconds:.0f} s in all, {on_disk(seconds)}"
        announce(what, expected_s)
        make_dataset(plan, self.out, jobs, self.workers())

    def _make_benchmark(self, name: str) -> None:
        from evaluation.datasets.sealed import Draw, make_benchmark
        from evaluation.measure.levels.level import load_level
        from evaluation.setup.progress import announce

        given = self.scenes, self.seeds, self.split, self.dials, self.duration_s, self.sensors
        if any(given) or self.jobs != 1 or self.flight:
            raise InputError(f"--level {name}: fixes all but --flights, --seed, --sealed and --out")
        level = load_level(name)
        flights = level.flights if self.flights is None else self.flights
        draw = Draw(level, int(in_range("--flights", flights, low=1)), self.checked_seed())
        planned = [first for first, *_ in draw.tries()]
        seconds = sum(flight.scene.duration_s for flight in planned)
        expected_s = work_s(seconds * RENDER_S_PER_S, self.workers())
        what = f"records {len(planned)} flights, {seconds:.0f} s in all, {on_disk(seconds)}"
        announce(what, expected_s)
        make_benchmark(draw, self.out, self.sealed, self.workers())


@dataclass(frozen=True, kw_only=True)
class Render(Verb):
    """Add truth of pixels, lidar scans or stereo pairs to a recording.

    Depth, normals, segmentation and optical flow of both robots' images, scans of a rotating
    lidar on the ground robot, and images of a second camera beside each robot's. All follow from
    the stored motion; stereo builds the world again. docs/datasets.md has the encodings.
    """

    recording: Annotated[Positional[Path], Shown("RECORDING")]
    """folder that simulate has written"""
    add: Annotated[str, Shown("LIST")]
    """what to add, of depth, normals, segmentation, flow, lidar, stereo; as in depth,flow"""
    robot: Annotated[
        Literal["mav", "ground", "both"] | None, Shown("{mav,ground,both}", "those recorded")
    ] = None
    """robot whose images are rendered"""
    every: Annotated[int, Shown("N")] = 1
    """every so many-th image or scan; flow leads to the next of all images"""
    beams: Annotated[int | None, Shown("N", "32")] = None
    """beams of the lidar, 16 to 128"""
    baseline: Annotated[float | None, Shown("M", "0.11, as EuRoC's")] = None
    """distance of the second camera of stereo pairs, to the right [m]"""
    scene: Annotated[str | None, Shown("FILE", "the package's scene of that name")] = None
    """scene that the recording is of, for stereo: a .toml file"""
    out: Annotated[Path | None, Shown("DIR", "truth/ in the recording")] = None
    """folder for ROBOT_depth/, ground_lidar/ and so on; these must not exist"""

    def main(self) -> None:
        from evaluation.datasets.lidar_files import count_scans, render_scans
        from evaluation.datasets.pixel_truth_files import (
            LIDAR,
            MODALITIES,
            STEREO,
            Wanted,
            count_images,
            parse_modalities,
            render_truth,
        )
        from evaluation.datasets.simulated import Simulated
        from evaluation.datasets.stereo_files import BASELINE_M, count_pairs, render_stereo
        from evaluation.setup.progress import step
        from sim.robots.motion import ROBOTS
        from sim.sensors.lidar import Lidar

        every = int(in_range("--every", self.every, low=1))
        added = parse_modalities(self.add)
        if LIDAR in added and self.robot == "mav":
            raise InputError("--add lidar: the ground robot carries it; give no --robot mav")
        if self.beams is not None and LIDAR not in added:
            raise InputError("--beams: only with --add lidar")
        if STEREO not in added and (self.baseline is not None or self.scene is not None):
            raise InputError("--baseline and --scene: only with --add stereo")
        baseline_m = BASELINE_M if self.baseline is None else self.baseline
        in_range("--baseline", baseline_m, low=0.001, high=5.0)
        lidar = Lidar() if self.beams is None else Lidar(beams=self.beams)
        simulated = Simulated.open(self.recording)
        asked = {None: simulated.robots, "both": ROBOTS, "mav": ("mav",), "ground": ("ground",)}
        robots = asked[self.robot]
        simulated.check_recorded((*robots, "ground") if LIDAR in added else robots)
        wanted = Wanted(robots, tuple(name for name in added if name in MODALITIES), every)
        out = simulated.truth.folder if self.out is None else self.out
        if wanted.modalities:
            with step("rendering", count_images(simulated, wanted), "images") as rendering:
                render_truth(simulated, wanted, out, self.workers(), rendering.advance)
        if LIDAR in added:
            with step("scanning", count_scans(simulated, lidar, every), "scans") as scanning:
                render_scans(simulated, lidar, every, out, scanning.advance)
        if STEREO in added:
            with step("drawing pairs", count_pairs(simulated, wanted), "images") as drawing:
                render_stereo(
                    simulated, wanted, baseline_m, self.scene, out, self.workers(), drawing.advance
                )


@dataclass(frozen=True, kw_only=True)
class Inspect(FolderOptions, Verb):
    """Say what is in a dataset, and what is wrong with it.

    For recordings and datasets of simulate, folders of EuRoC, TUM RGB-D and 7-Scenes, and ROS bags:
    digests, rates, gaps, calibration, what was assumed, and whether the true poses fit the images.
    Of a folder of recordings, each. Exits with 3 if something is wrong.
    """

    dataset: Annotated[Positional[Path], Shown("DATASET")]
    """folder of the dataset, or a bag"""
    json: bool = False
    """print JSON in place of a table"""
    page: Annotated[Path | None, Shown("FILE.html")] = None
    """draw a page of it: images, paths from above, motion, overlap and light"""

    def main(self) -> int:
        from evaluation.datasets.gallery.page import dataset_page
        from evaluation.datasets.inspection.findings import Verdict, as_json, show
        from evaluation.datasets.inspection.inspect_dataset import inspect_dataset
        from evaluation.setup.output import check_new_file, write_whole
        from evaluation.setup.progress import step

        if self.page is not None:
            check_new_file(self.page, "--page")
        with step("inspecting"):
            layout, findings = inspect_dataset(self.dataset, self.open)
        if self.page is not None:
            write_whole(self.page, dataset_page(self.dataset, self.open, findings))
        if self.json:
            print(as_json(str(self.dataset), layout, findings))
        else:
            show(f"{self.dataset} ({layout})", findings)
        wrong = any(finding.verdict is Verdict.WRONG for finding in findings)
        return EXIT_FAULT_FOUND if wrong else EXIT_OK


@dataclass(frozen=True, kw_only=True)
class Export(OutOption, Verb):
    """Write a recording, with its truth, in a format that other tools read.

    docs/datasets.md says for each format what lies where, in which axes and units.
    """

    recording: Annotated[Positional[Path], Shown("RECORDING")]
    """folder that simulate has written"""
    format: Literal["tum", "euroc", "mcap", "nerfstudio", "colmap", "webdataset"]
    """tum is of the ground robot, euroc of the MAV, the others of either"""
    robot: Annotated[
        Literal["mav", "ground", "both"] | None, Shown("{mav,ground,both}", "what the format holds")
    ] = None
    """robot whose sensors are written"""

    def main(self) -> None:
        from evaluation.datasets.formats import FORMATS, robots_for, robots_in
        from evaluation.datasets.simulated import Simulated
        from evaluation.setup.output import check_free, fresh_folder
        from evaluation.setup.progress import announce, step

        chosen = FORMATS[self.format]
        robots_for(self.format, self.robot)  # before the recording is read
        check_free(self.out)
        with step("comparing digests"):
            simulated = Simulated.open(self.recording)
        robots = robots_in(simulated, self.format, self.robot)
        announce(f"writes {self.format}, {in_megabytes(chosen.expected_mb(simulated, robots))}")
        with fresh_folder(self.out) as folder, step(f"writing {self.format}"):
            chosen.write(folder, simulated, robots)
