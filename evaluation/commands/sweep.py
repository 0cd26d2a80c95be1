"""`airground sweep`: what is measured when a dial is turned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from tyro.conf import UseAppendAction

from airground.errors import InputError
from evaluation.commands.options import (
    MEASURE_S_PER_S,
    RENDER_S_PER_S,
    ClusterOption,
    PipelineOptions,
    ResumableOutOption,
    SeedOption,
    SensorOption,
    Shown,
    Verb,
    in_range,
    work_s,
)
from evaluation.commands.sections import USED

if TYPE_CHECKING:
    from airground.config import Config
    from evaluation.measure.plans.sweep import SweepPlan


SEQUENCES, TRIALS = 7, 12
"""Of each flight, unless section protocol says otherwise."""


@dataclass(frozen=True, kw_only=True)
class Sweep(SensorOption, SeedOption, PipelineOptions, ResumableOutOption, ClusterOption, Verb):
    """Turn dials, and measure what that does: curves with intervals.

    Flies the same flights at every combination of the values, and writes results.parquet with
    a column for each dial, sweep.json and figures. docs/sweep.md lists the dials. Section protocol
    of the configuration says how much is measured on each flight (docs/parameters.md).
    """

    sections: ClassVar[tuple[str, ...]] = USED["sweep"]

    vary: Annotated[UseAppendAction[tuple[str, ...]], Shown("NAME=VALUE,VALUE,...")] = ()
    """dial (docs/sweep.md) or parameter, with values; repeatable"""
    scenes: Annotated[tuple[str, ...], Shown("SCENE ...")] = ("tiny",)
    """scenes to fly over"""
    flights: Annotated[int, Shown("N")] = 4
    """flights over each scene, every one over a heap of its own"""
    duration_s: Annotated[float | None, Shown("S", "the scene's")] = None
    """length of each flight [s]"""

    def main(self) -> None:
        from evaluation.judge.sweep import sweep
        from evaluation.measure.work.crew import Crew
        from evaluation.measure.work.out_folder import resumable_folder
        from evaluation.setup.progress import announce
        from evaluation.show.sweep_results import print_sweep, write_sweep

        plan = self.plan()
        recorded_s = sum(self.duration_s or scene.duration_s for scene in plan.scenes)
        passes = plan.tasks()
        core_s = recorded_s / len(plan.scenes) * passes * (RENDER_S_PER_S + MEASURE_S_PER_S)
        what = f"measures {len(plan.points())} points, {passes} passes over flights"
        with (
            resumable_folder(self.out) as folder,
            Crew(self.cluster, self.workers(), plan.tasks(), folder.scratch) as crew,
        ):
            announce(what, work_s(core_s, self.workers()))
            measured = sweep(plan, folder.store, crew)
            write_sweep(folder.results, plan, measured)
        print_sweep(plan, measured)

    def plan(self) -> SweepPlan:
        """What the words ask for, checked as far as can be without flying."""
        from evaluation.measure.plans.sweep import SweepPlan, parse_vary
        from evaluation.measure.protocol.trials import Protocol
        from sim.scene import load_scene
        from sim.sensors.presets import sensor_preset

        asked = self.settings().protocol
        for name in ("baselines", "only_images"):
            if getattr(asked, name) is not None:
                raise InputError(f"protocol.{name}: a sweep tries no baselines")
        if self.duration_s is not None:
            in_range("--duration-s", self.duration_s, low=1, high=600)
        varied = parse_vary(self.vary)
        setup = self.setup()
        for vary in varied:
            self._check_alone(vary.name, setup.config)
        plan = SweepPlan(
            varied=varied,
            scenes=tuple(load_scene(scene) for scene in self.scenes),
            flights=int(in_range("--flights", self.flights, low=1)),
            setup=setup,
            sensors=sensor_preset(self.sensors_name()),
            protocol=Protocol(asked.sequences_per_flight or SEQUENCES, asked.trials or TRIALS),
            seed=self.checked_seed(),
            duration_s=self.duration_s,
        )
        for point in plan.points():
            plan.units(point)
        return plan

    def varied(self) -> tuple[str, ...]:
        return tuple(word.partition("=")[0].strip() for word in self.vary)

    def _check_alone(self, name: str, config: Config) -> None:
        """InputError if what is varied changes nothing, or has a value by another option, too."""
        from evaluation.setup.switches import switched_off

        section, _, key = name.partition(".")
        if reason := self.idle(section, key) or switched_off(config, name, self.varied()):
            raise InputError(f"--vary {name}: {reason}")
        by_heading = name == "localization.heading" and self.north is not None
        if by_heading or self.sets(name):
            word = "--heading" if by_heading else f"--set {name}"
            raise InputError(f"{word}: --vary gives its values; give one of the two")
