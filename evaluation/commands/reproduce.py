"""`airground reproduce`: the paper's protocol, from scenes to report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import arg

from airground.errors import InputError
from evaluation.commands.words import OutWord, SeedWord, SensorWord, SetupWords, Verb, in_range

if TYPE_CHECKING:
    from collections.abc import Callable

    from evaluation.reproduce import Findings, Plan

SCENES = ("indoor_a", "indoor_b", "indoor_c", "flat")
FLIGHTS, SEQUENCES, TRIALS, BASELINES = 2, 7, 12, 12
"""Over three scenes with structure: 42 sequences and 72 trials; the paper has 41 and 67."""

QUICK_SCENES = ("tiny",)
QUICK_FLIGHTS, QUICK_SEQUENCES, QUICK_TRIALS, QUICK_BASELINES = 1, 4, 8, 0


@dataclass(frozen=True, kw_only=True)
class Reproduce(Verb, SetupWords, SensorWord, SeedWord, OutWord):
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
    sequences: Annotated[
        int | None, arg(metavar="N", help_behavior_hint=f"(default: {SEQUENCES})")
    ] = None
    """Sequences of 12 aerial maps a flight."""
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
        from evaluation.output import fresh_folder
        from evaluation.results_folder import Results
        from evaluation.screen import print_summary

        measure = self._protocol() if self.suite is None else self._suite(self.suite)
        setup, seed = self.setup(), self.checked_seed()
        with fresh_folder(self.out) as folder:
            findings = measure(self.recordings or folder / "recordings")
            summary = Results(findings.table, setup.config, seed, findings.showcase).write(folder)
        print_summary(summary)

    def _protocol(self) -> Callable[[Path], Findings]:
        from evaluation.reproduce import reproduce

        plan = self.plan()
        return lambda recordings: reproduce(
            plan, None if self.render else recordings, self.workers()
        )

    def _suite(self, name: str) -> Callable[[Path], Findings]:
        from evaluation.regression.suite import SUITES, run_suite

        fixed = ("quick", "budget", "render", "scenes", "flights", "sequences", "trials")
        for word in (*fixed, "baselines"):
            if getattr(self, word):
                raise InputError(f"--{word}: the suite {name} is fixed; give --{word} without it")
        setup, seed = self.setup(), self.checked_seed()
        return lambda recordings: run_suite(
            SUITES[name], setup, self.sensors, seed, recordings, self.workers()
        )

    def plan(self) -> Plan:
        """What the words ask for, checked."""
        from evaluation.experiment import Protocol
        from evaluation.reproduce import Plan
        from evaluation.setups import with_companions
        from sim.presets import sensor_preset
        from sim.scene import load_scene

        setup = self.setup()
        if self.budget and setup.poses != "slam":
            raise InputError("--budget asks what SLAM loses among others; give --poses slam")
        if self.render and self.recordings is not None:
            raise InputError("--render keeps no recordings; leave out --recordings")
        scenes = self.scenes or (QUICK_SCENES if self.quick else SCENES)
        return Plan(
            scenes=[load_scene(scene) for scene in scenes],
            flights=self._count("flights", QUICK_FLIGHTS, FLIGHTS),
            setups=[setup] if self.alone else with_companions(setup, few=self.quick),
            sensors=sensor_preset(self.sensors),
            protocol=Protocol(
                sequences=self._count("sequences", QUICK_SEQUENCES, SEQUENCES),
                trials=self._count("trials", QUICK_TRIALS, TRIALS),
                baselines=self._count("baselines", QUICK_BASELINES, BASELINES, low=0),
            ),
            seed=self.checked_seed(),
            budget=self.budget,
        )

    def _count(self, name: str, quick: int, full: int, low: int = 1) -> int:
        asked = getattr(self, name)
        if asked is None:
            return quick if self.quick else full
        return int(in_range(f"--{name}", asked, low=low))
