"""`airground bench`: how fast the stages are here."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from evaluation.commands.words import SeedWord, SensorWord, Verb, in_range

if TYPE_CHECKING:
    from evaluation.bench.report import BenchReport

SCENE = "tiny"


@dataclass(frozen=True, kw_only=True)
class Bench(Verb, SensorWord, SeedWord):
    """Time the pipeline's stages on this machine (Table I).

    Each stage runs on one core and on all, in turns with what other libraries offer, on
    the data of one recording; beside it stand the paper's figure and the least time that
    this machine's memory and arithmetic allow. docs/speed.md says how to read it.
    """

    recording: Annotated[
        Path | None, arg(metavar="DIR", help_behavior_hint=f"(default: a new one of {SCENE})")
    ] = None
    """A folder that simulate has written."""
    out: Annotated[Path | None, arg(metavar="DIR", help_behavior_hint="(optional)")] = None
    """Folder to make for bench.json, bench.md and the pictures; it must not exist."""
    json: bool = False
    """Print the figures as JSON, and nothing else, on stdout."""
    rows: Annotated[str, arg(metavar="A,B", help_behavior_hint="(default: all)")] = ""
    """Only these rows, by their names in JSON; "pipeline" is the real-time factor."""
    curves: bool = False
    """Also vary the sizes, one at a time, and fit how times grow."""
    seconds_a_row: Annotated[float, arg(metavar="S")] = 4.0
    """Time for each row with its peers, and for each curve."""

    def main(self) -> None:
        import tempfile

        from rich.console import Console

        from evaluation.bench.publish import print_table
        from evaluation.bench.rows import checked_names
        from evaluation.bench.run import run_benchmark
        from evaluation.setup.output import check_free
        from evaluation.setup.progress import step

        names = checked_names([name for name in self.rows.split(",") if name])
        seconds = in_range("--seconds-a-row", self.seconds_a_row, low=0.0, high=3600)
        if self.out is not None:
            check_free(self.out)
        with (
            tempfile.TemporaryDirectory(prefix="airground-bench-") as scratch,
            step("benchmark") as benchmark,
        ):
            path = self.recording
            if path is None:
                benchmark.say(f"recording {SCENE}")
                path = self._record(Path(scratch) / SCENE)
            report = run_benchmark(path, names, self.workers(), seconds, self.curves, benchmark.say)
        self._write(report)
        if self.json:
            print(report.to_json(), end="")
        else:
            print_table(report, Console())

    def _record(self, path: Path) -> Path:
        from sim.recording.recorder import record
        from sim.scene import load_scene
        from sim.sensors.presets import sensor_preset

        sensors, seed = sensor_preset(self.sensors), self.checked_seed()
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
