"""`airground reproduce`: the paper's protocol, from scenes to report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import arg

from airground.errors import InputError
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
    from evaluation.measure.plans.reproduce import Plan

SCENES = ("indoor_a", "indoor_b", "indoor_c", "outdoor", "flat")
FLIGHTS, SEQUENCES, TRIALS, BASELINES = 2, 6, 9, 12
"""Over four scenes with structure: 48 sequences and 72 trials; the paper has 41 and 67."""

QUICK_SCENES = ("tiny",)
QUICK_FLIGHTS, QUICK_SEQUENCES, QUICK_TRIALS, QUICK_BASELINES = 1, 4, 8, 0


@dataclass(frozen=True, kw_only=True)
class Reproduce(Verb, SetupWords, SensorWord, SeedWord, ResumableOutWord, ClusterWord):
    """Do all of it: the paper's protocol, from scenes to report.

    Records flights over several scenes, measures the setup asked for and, beside it, those
    that the report compares it with, and writes results.parquet, summary.json, report.html.
    """

    suite: Annotated[
        Literal["fast"] | None, arg(metavar="{fast}", help_behavior_hint="(optional)")
    ] = None
    """Instead, a fixed small suite that check is meant for: only the setup asked for."""
    quick: bool = False
    """One small scene and a short flight: minutes instead of hours."""
    alone: bool = False
    """Measure only the setup asked for, nothing beside it."""
    budget: bool = False
    """Also measure what each stage loses, by putting the truth in its place: three more
    passes over each recording."""
    scenes: Annotated[
        tuple[str, ...],
        arg(metavar="SCENE ...", help_behavior_hint=f"(default: {' '.join(SCENES)})"),
    ] = ()
    """Scenes to fly over."""
    flights: Annotated[int | None, arg(metavar="N", help_behavior_hint=f"(default: {FLIGHTS})")] = (
        None
    )
    """Flights over each scene."""
    sequences_per_flight: Annotated[
        int | None, arg(metavar="N", help_behavior_hint=f"(default: {SEQUENCES})")
    ] = None
    """Sequences of 12 aerial maps a flight, at most."""
    sequences: Annotated[
        int | None, arg(metavar="N", help_behavior_hint="(default: what the flights give)")
    ] = None
    """At least so many in all: where the flights give fewer, the same scenes and flights follow
    with the next seeds, `flat` apart; on these only the setup asked for, and what shares its
    maps, as a searched heading does."""
    trials: Annotated[int | None, arg(metavar="N", help_behavior_hint=f"(default: {TRIALS})")] = (
        None
    )
    """Refinements from a noisy start a flight."""
    baselines: Annotated[
        int | None,
        arg(metavar="N", help_behavior_hint=f"(default: {BASELINES}; with --quick 0)"),
    ] = None
    """How many of these every baseline is tried on as well; 0 for none."""
    recordings: Annotated[
        Path | None, arg(metavar="DIR", help_behavior_hint="(default: recordings/ in --out)")
    ] = None
    """Where recordings are kept; those that are there already are used again."""
    render: bool = False
    """Keep no recordings: draw the images while they are measured, once more for each pass.
    The results are the same, but for times, which then include waiting for images."""

    def main(self) -> None:
        from evaluation.judge.results import Results
        from evaluation.measure.work.crew import Crew
        from evaluation.measure.work.out_folder import resumable_folder
        from evaluation.show.report.page import write_results
        from evaluation.show.report.screen import print_summary

        if self.render and self.recordings is not None:
            raise InputError("--render keeps no recordings; leave out --recordings")
        plan = self.plan() if self.suite is None else self._suite(self.suite)
        setup, seed = self.setup(), self.checked_seed()
        with (
            resumable_folder(self.out) as folder,
            Crew(self.cluster, self.workers(), plan.tasks(), folder.scratch) as crew,
        ):
            recordings = self.recordings or folder.recordings
            found = plan.measured(None if self.render else recordings, folder.store, crew)
            results = Results(found.table, setup.config, seed, found.showcase)
            summary = write_results(results, folder.results)
        print_summary(summary)

    def _suite(self, name: str) -> Plan:
        from evaluation.measure.plans.suite import SUITES
        from sim.sensors.presets import sensor_preset

        fixed = ("quick", "budget", "scenes", "flights", "sequences_per_flight")
        for field in (*fixed, "sequences", "trials", "baselines"):
            if getattr(self, field):
                word = field.replace("_", "-")
                raise InputError(f"--{word}: the suite {name} is fixed; give --{word} without it")
        sensors = sensor_preset(self.sensors)
        return SUITES[name].plan(self.setup(), sensors, self.checked_seed())

    def plan(self) -> Plan:
        """What the words ask for, checked."""
        from evaluation.measure.plans.reproduce import Plan, flights_over
        from evaluation.measure.protocol.trials import Protocol
        from evaluation.setup.setups import with_companions
        from sim.scene import load_scene
        from sim.sensors.presets import sensor_preset

        setup = self.setup()
        if self.budget and setup.poses != "slam":
            raise InputError("--budget asks what SLAM loses among others; give --poses slam")
        names = self.scenes or (QUICK_SCENES if self.quick else SCENES)
        return Plan(
            flights=flights_over(
                [load_scene(name) for name in names],
                self._count("flights", QUICK_FLIGHTS, FLIGHTS),
                sensor_preset(self.sensors),
                self.checked_seed(),
            ),
            setups=[setup] if self.alone else with_companions(setup, few=self.quick),
            protocol=Protocol(
                sequences=self._count("sequences_per_flight", QUICK_SEQUENCES, SEQUENCES),
                trials=self._count("trials", QUICK_TRIALS, TRIALS),
                baselines=self._count("baselines", QUICK_BASELINES, BASELINES, low=0),
            ),
            budget=self.budget,
            sequences=int(in_range("--sequences", self.sequences or 0)),
        )

    def _count(self, name: str, quick: int, full: int, low: int = 1) -> int:
        asked = getattr(self, name)
        if asked is None:
            return quick if self.quick else full
        return int(in_range(f"--{name.replace('_', '-')}", asked, low=low))
