"""`airground bench` and `doctor`: how fast this machine is, and what it lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional

from airground.errors import InputError
from evaluation.commands.options import (
    RENDER_S_PER_S,
    SeedOption,
    SensorOption,
    Shown,
    Verb,
    in_range,
    work_s,
)
from evaluation.setup.console import EXIT_FAULT_FOUND, EXIT_OK

if TYPE_CHECKING:
    from evaluation.bench.report import BenchReport

SCENE = "tiny"
PLAY_S = 120.0
"""The recording of `SCENE` played through the pipeline on one core and on all, and live [s]."""
SIMULATE_S = 80.0
"""One of the rows that simulate a recording of 60 s [s]."""


@dataclass(frozen=True, kw_only=True)
class Bench(SensorOption, SeedOption, Verb):
    """Time the pipeline's stages on this machine (Table I).

    Each stage runs on one core and on all, in turns with what other libraries offer, on
    the data of one recording; beside it stand the paper's figure and the least time that
    this machine's memory and arithmetic allow. docs/speed.md says how to read it.
    """

    recording: Annotated[Path | None, Shown("DIR", f"a new one of {SCENE}")] = None
    """folder that simulate has written"""
    rows: Annotated[str, Shown("A,B", "all")] = ""
    """only these, by names in JSON; pipeline: real-time factor"""
    curves: bool = False
    """also vary the sizes, one at a time, and fit how times grow"""
    seconds_a_row: Annotated[float, Shown("S")] = 4.0
    """time for each row with its peers, and for each curve [s]"""
    out: Annotated[Path | None, Shown("DIR")] = None
    """folder to make for bench.json, bench.md and pictures"""
    json: bool = False
    """print the figures as JSON, and nothing else, on stdout"""

    def main(self) -> None:
        from rich.console import Console

        from airground.core.scratch_folder import ScratchFolder
        from evaluation.bench.publish import print_table
        from evaluation.bench.rows import RECORDED, checked_names
        from evaluation.bench.run import run_benchmark
        from evaluation.setup.output import check_free
        from evaluation.setup.progress import announce, step
        from sim.scene import load_scene

        self._check_used()
        names = checked_names([name for name in self.rows.split(",") if name])
        seconds = in_range("--seconds-a-row", self.seconds_a_row, low=0.0, high=3600)
        if self.out is not None:
            check_free(self.out)
        parts = self._parts(names)
        recorded_s = 0.0 if self.recording is not None else load_scene(SCENE).duration_s
        expected_s = work_s(recorded_s * RENDER_S_PER_S, self.workers())
        expected_s += PLAY_S + parts * seconds
        expected_s += sum(SIMULATE_S for name in names if name in RECORDED)
        cores = "1 core" if self.workers() == 1 else f"1 and {self.workers()} cores"
        announce(f"times {len(names)} rows on {cores}", expected_s)
        with (
            ScratchFolder() as scratch,
            step("benchmark", parts, "parts") as benchmark,
        ):
            path = self.recording
            if path is None:
                benchmark.say(f"recording {SCENE}")
                path = self._record(scratch.path / SCENE)
            report = run_benchmark(
                path, names, self.workers(), seconds, self.curves, benchmark.next
            )
        self._write(report)
        if self.json:
            print(report.to_json(), end="")
        else:
            print_table(report, Console())

    def _check_used(self) -> None:
        """InputError for what describes the new recording, if another one is given."""
        for word, given in (("--sensors", self.sensors), ("--seed", self.seed)):
            if self.recording is not None and given is not None:
                raise InputError(
                    f"{word} {given}: of the recording that bench makes, but --recording gives "
                    f"{self.recording}; give one of the two"
                )

    def _parts(self, names: Sequence[str]) -> int:
        """How many parts the benchmark names as it goes on."""
        from evaluation.bench.curves import CURVES
        from evaluation.bench.rows import BY_NAME, LIVE, RECORDED

        lanes = len({1, self.workers()})
        rows = sum(name in BY_NAME for name in names)
        whole = sum(name in RECORDED for name in names)
        return lanes + rows + whole + (LIVE in names) + (len(CURVES) if self.curves else 0)

    def _record(self, path: Path) -> Path:
        from sim.recording.recorder import record
        from sim.scene import load_scene
        from sim.sensors.presets import sensor_preset

        sensors, seed = sensor_preset(self.sensors_name()), self.checked_seed()
        record(load_scene(SCENE), seed, sensors, path, workers=self.workers())
        return path

    def _write(self, report: BenchReport) -> None:
        if self.out is None:
            return
        from evaluation.bench.picture import bench_figure, curves_figure
        from evaluation.bench.publish import markdown
        from evaluation.setup.output import fresh_folder
        from evaluation.show.figures.style import save_figure

        with fresh_folder(self.out) as folder:
            (folder / "bench.json").write_text(report.to_json(), encoding="utf-8")
            (folder / "bench.md").write_text(markdown(report), encoding="utf-8")
            if report.rows:
                save_figure(bench_figure(report), folder, "bench")
            if report.curves:
                save_figure(curves_figure(report), folder, "curves")


@dataclass(frozen=True, kw_only=True)
class Doctor(Verb):
    """Look whether this machine can render and compute, and say what is missing.

    Exits with 3 if something is missing without which nothing works. With --clean it only removes
    what killed commands left in FOLDER, in results and datasets directly in it, and among temporary
    files; what a running process uses, and what the same command continues, is listed and kept.
    """

    folder: Annotated[Positional[Path], Shown("FOLDER", "the current one")] = Path()
    """folder that --clean looks through"""
    clean: bool = False
    """list what killed commands left, with sizes, and remove it"""

    def main(self) -> int:
        from evaluation.commands.leftovers import clean, finding, leftovers, print_leftovers
        from evaluation.setup.doctor import Health, examine, show

        if self.clean:
            found = leftovers(self.folder)
            print_leftovers(found, clean(found))
            return EXIT_OK
        if self.folder != Path():
            raise InputError(f"{self.folder}: a folder goes with --clean alone")
        findings = [*examine(), finding(leftovers(self.folder))]
        show(findings)
        broken = any(one.health == Health.BROKEN for one in findings)
        return EXIT_FAULT_FOUND if broken else EXIT_OK
