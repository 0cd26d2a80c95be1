"""`airground sweep`: what is measured when a dial is turned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from tyro.conf import UseAppendAction, arg

from evaluation.commands.words import (
    ClusterWord,
    ResumableOutWord,
    SeedWord,
    SensorWord,
    SetupWords,
    Verb,
    in_range,
)

if TYPE_CHECKING:
    from evaluation.measure.plans.sweep import SweepPlan


@dataclass(frozen=True, kw_only=True)
class Sweep(Verb, SetupWords, SensorWord, SeedWord, ResumableOutWord, ClusterWord):
    """Turn dials, and measure what that does: curves with intervals.

    Flies the same flights at every combination of the values, and writes results.parquet with
    a column for each dial, sweep.json and figures. docs/sweep.md lists the dials.
    """

    vary: Annotated[
        UseAppendAction[tuple[str, ...]],
        arg(metavar="NAME=VALUE,VALUE,...", help_behavior_hint="(repeatable)"),
    ] = ()
    """A dial and its values: scene.overlap=0.4,0.6,0.8 or any parameter of the pipeline."""
    scenes: Annotated[tuple[str, ...], arg(metavar="SCENE ...")] = ("tiny",)
    """Scenes to fly over."""
    flights: Annotated[int, arg(metavar="N")] = 4
    """Flights over each scene, every one over a heap of its own."""
    sequences: Annotated[int, arg(metavar="N")] = 7
    """Sequences of 12 aerial maps a flight."""
    trials: Annotated[int, arg(metavar="N")] = 12
    """Refinements from a noisy start a flight."""
    duration_s: Annotated[
        float | None, arg(metavar="S", help_behavior_hint="(default: the scene's)")
    ] = None
    """Cut flights short."""

    def main(self) -> None:
        from evaluation.judge.sweep import sweep
        from evaluation.measure.work.crew import Crew
        from evaluation.measure.work.out_folder import resumable_folder
        from evaluation.show.sweep_results import print_sweep, write_sweep

        plan = self.plan()
        with (
            resumable_folder(self.out) as folder,
            Crew(self.cluster, self.workers(), plan.tasks(), folder.scratch) as crew,
        ):
            measured = sweep(plan, folder.store, crew)
            write_sweep(folder.results, plan, measured)
        print_sweep(plan, measured)

    def plan(self) -> SweepPlan:
        """What the words ask for, checked as far as can be without flying."""
        from evaluation.measure.plans.sweep import SweepPlan, parse_vary
        from evaluation.measure.protocol.trials import Protocol
        from sim.scene import load_scene
        from sim.sensors.presets import sensor_preset

        counts = {
            name: int(in_range(f"--{name}", getattr(self, name), low=1))
            for name in ("flights", "sequences", "trials")
        }
        if self.duration_s is not None:
            in_range("--duration-s", self.duration_s, low=1, high=600)
        plan = SweepPlan(
            varied=parse_vary(self.vary),
            scenes=tuple(load_scene(scene) for scene in self.scenes),
            flights=counts["flights"],
            setup=self.setup(),
            sensors=sensor_preset(self.sensors),
            protocol=Protocol(counts["sequences"], counts["trials"]),
            seed=self.checked_seed(),
            duration_s=self.duration_s,
        )
        for point in plan.points():
            plan.units(point)
        return plan
