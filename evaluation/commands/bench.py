"""`airground bench`: how fast the stages are here."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from evaluation.commands.words import SeedWord, SensorWord, SetupWords, Verb

SCENE = "tiny"


@dataclass(frozen=True, kw_only=True)
class Bench(Verb, SetupWords, SensorWord, SeedWord):
    """Time the pipeline's stages on this machine (Table I).

    Runs the pipeline twice over one recording, first to compile its kernels, and shows the
    medians of the second run beside the paper's averages.
    """

    recording: Annotated[
        Path | None, arg(metavar="DIR", help_behavior_hint=f"(default: a new one of {SCENE})")
    ] = None
    """A folder that simulate has written."""

    def main(self) -> None:
        import tempfile

        with tempfile.TemporaryDirectory(prefix="airground-bench-") as scratch:
            self._bench(self.recording or self._record(Path(scratch) / SCENE))

    def _record(self, path: Path) -> Path:
        from sim.presets import sensor_preset
        from sim.recorder import record
        from sim.scene import load_scene

        sensors, seed = sensor_preset(self.sensors), self.checked_seed()
        record(load_scene(SCENE), seed, sensors, path, workers=self.workers())
        return path

    def _bench(self, path: Path) -> None:
        from rich.console import Console
        from rich.table import Table

        from airground.io.recording import Recording
        from evaluation.report_tables import timing_table
        from evaluation.run import run_recording
        from sim.truth import Truth

        setup, seed = self.setup(), self.checked_seed()
        recording, truth = Recording.open(path), Truth.open(path)
        for _ in range(2):
            result = run_recording(recording, truth, setup, seed)
        table = timing_table(result.table)
        shown = Table(title=f"{recording.scene}, {self.workers()} threads", title_justify="left")
        for column in table.header:
            shown.add_column(column)
        for row in table.rows:
            shown.add_row(*row)
        Console().print(shown)
