"""`airground simulate`: a recording of one flight, or a dataset of many."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import Positional, UseAppendAction, arg

from airground.errors import InputError
from evaluation.commands.words import OutWord, SeedWord, SensorWord, Verb, in_range


@dataclass(frozen=True, kw_only=True)
class Simulate(Verb, SensorWord, SeedWord, OutWord):
    """Record what the robots' sensors see in a scene, or in many.

    Drops the boxes, flies and drives both robots, renders their cameras, and keeps the truth
    apart in truth/. The recording opens in tools that read EuRoC and TUM RGB-D. With --seeds it
    makes a dataset of every scene with every seed, and its data sheet; called again after it was
    cut short, it makes what is missing.
    """

    scenes: Annotated[Positional[tuple[str, ...]], arg(metavar="SCENE...")]
    """Scenes that come with the package (an unknown name lists them), or .toml files."""
    flight: int = 0
    """Which flight over the same heap: moves the waypoints a little, draws other noise."""
    duration_s: Annotated[
        float | None, arg(metavar="S", help_behavior_hint="(default: the scene's own)")
    ] = None
    """Stop recording after this time."""
    seeds: Annotated[
        str | None, arg(metavar="LIST", help_behavior_hint="(optional: many recordings)")
    ] = None
    """Make a dataset with these seeds, as in 0-9 or 1,4,10-12."""
    split: Annotated[
        UseAppendAction[tuple[str, ...]],
        arg(metavar="NAME=SHARE", help_behavior_hint="(repeatable)"),
    ] = ()
    """With --seeds: a part with this share of the worlds, as in test=0.2; the rest is train."""
    jobs: Annotated[int, arg(metavar="N")] = 1
    """With --seeds: recordings made at a time."""

    def main(self) -> None:
        if self.duration_s is not None:
            in_range("--duration-s", self.duration_s, low=1.0)
        if self.seeds is None:
            self._record_one()
        else:
            self._make_dataset(self.seeds)

    def _record_one(self) -> None:
        from evaluation.setup.output import check_free
        from evaluation.setup.progress import step
        from sim.recording.recorder import record
        from sim.scene import load_scene
        from sim.sensors.presets import sensor_preset

        if len(self.scenes) != 1 or self.split or self.jobs != 1:
            raise InputError("several scenes, --split and --jobs: only with --seeds")
        check_free(self.out)
        with step("rendering", unit="images") as rendering:
            record(
                load_scene(self.scenes[0]),
                self.checked_seed(),
                sensor_preset(self.sensors),
                self.out,
                self.duration_s,
                self.workers(),
                flight=int(in_range("--flight", self.flight)),
                progress=rendering.move_to,
            )

    def _make_dataset(self, seeds: str) -> None:
        from evaluation.datasets.collection import make_dataset
        from evaluation.datasets.plan import parse_seeds, parse_split, plan_dataset

        if not self.scenes or self.seed or self.flight:
            raise InputError("--seeds: with at least one SCENE, and without --seed and --flight")
        plan = plan_dataset(
            self.scenes,
            parse_seeds(seeds),
            parse_split(self.split),
            self.sensors,
            self.duration_s,
        )
        jobs = int(in_range("--jobs", self.jobs, low=1, high=1000))
        make_dataset(plan, self.out, jobs, self.workers())
