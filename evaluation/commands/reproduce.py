"""`airground reproduce`: the paper's protocol, from scenes to report."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tyro.conf import create_mutex_group

from airground.errors import InputError
from evaluation.commands.options import (
    MEASURE_S_PER_S,
    RENDER_S_PER_S,
    ClusterOption,
    PipelineOptions,
    ResumableOutOption,
    SeedOption,
    Shown,
    Verb,
    in_range,
    work_s,
)
from evaluation.commands.sections import USED

if TYPE_CHECKING:
    from evaluation.measure.levels.level import Level
    from evaluation.measure.plans.reproduce import Plan
    from evaluation.measure.protocol.trials import Protocol
    from evaluation.measure.suite import SuiteName
    from sim.recording.recorder import Flight


@dataclass(frozen=True)
class Extent:
    """What is flown and measured where no option says otherwise.

    Attributes:
        scenes: Scenes to fly over.
        flights: Flights over each.
        sequences, trials, baselines: Numbers on each flight, as of `Protocol`.
        heaps: Whether every flight is over a heap of its own.
        sensors: Sensor preset.
        negatives: Whether negative cases are tried.
        only_images: Whether only the baselines that match images are tried.
    """

    scenes: tuple[str, ...]
    flights: int
    sequences: int
    trials: int
    baselines: int
    heaps: bool = False
    sensors: str = "nominal"
    negatives: bool = True
    only_images: bool = False


FULL = Extent(("indoor_a", "indoor_b", "indoor_c", "outdoor", "flat"), 2, 6, 9, 12)
"""Over four scenes with structure: 48 sequences and 72 trials."""
TWIN = Extent(
    ("paper_a", "paper_b", "paper_c", "paper_outdoor"), 2, 7, 12, 10,
    heaps=True, sensors="paper", negatives=False, only_images=True,
)  # fmt: skip
"""The paper's four datasets: indoors 42 sequences and 72 trials, where the paper has 41 and 67;
outdoors pictures and matches of images."""
QUICK = Extent(("tiny",), 1, 4, 8, 0)

_SMALLER = create_mutex_group(required=False)
_STORAGE = create_mutex_group(required=False)


@dataclass(frozen=True, kw_only=True)
class RecordingOptions:
    """What becomes of the recordings."""

    heading: ClassVar[str] = "output"

    recordings: Annotated[Path | None, _STORAGE, Shown("DIR", "recordings/ in --out")] = None
    """keep recordings here, and use those there"""
    render: Annotated[bool, _STORAGE] = False
    """keep none: draw images while they are measured, in each pass"""


@dataclass(frozen=True, kw_only=True)
class Reproduce(
    SeedOption,
    PipelineOptions,
    ResumableOutOption,
    RecordingOptions,
    ClusterOption,
    Verb,
):
    """Do all of it: the paper's protocol, from scenes to report.

    Records flights over several scenes, measures the setup asked for and those that the report
    compares it with, and writes results.parquet, summary.json and report.html. --preset paper
    repeats the paper's experiments with sensors of their time (docs/reproduce_the_paper.md).
    Section protocol says how much is measured on each flight (docs/parameters.md).
    """

    sections: ClassVar[tuple[str, ...]] = USED["reproduce"]

    quick: Annotated[bool, _SMALLER] = False
    """one small scene and a short flight: minutes instead of hours"""
    suite: Annotated[Literal["fast", "hard", "faults"] | None, _SMALLER, Shown("NAME")] = None
    """suite for check: fast, hard or faults (docs/check_a_change.md)"""
    level: Annotated[
        Literal["paper", "easy", "medium", "hard", "extreme"] | None, _SMALLER, Shown("NAME")
    ] = None
    """a frozen level of difficulty (docs/levels.md), which fixes scenes, sensors and heading"""
    sensors: Annotated[
        Literal["none", "nominal", "harsh", "paper", "real"] | None,
        Shown("NAME", "nominal, or paper with --preset paper"),
    ] = None
    """noise of the sensors"""
    scenes: Annotated[
        tuple[str, ...],
        Shown("SCENE ...", "the indoor scenes, outdoor, flat; the paper's datasets"),
    ] = ()
    """scenes to fly over"""
    flights: Annotated[int | None, Shown("N", f"{FULL.flights}; {TWIN.flights}")] = None
    """flights over each scene; with --preset paper each over a heap of its own"""
    sequences: Annotated[int | None, Shown("N", "what the flights give")] = None
    """at least so many in all, over further heaps"""
    alone: bool = False
    """measure the setup asked for, nothing beside it"""
    budget: bool = False
    """also measure what each stage loses, with the truth in its place"""

    def main(self) -> None:
        from evaluation.judge.results import Results
        from evaluation.measure.work.crew import Crew
        from evaluation.measure.work.out_folder import resumable_folder
        from evaluation.setup.progress import announce, step
        from evaluation.show.report.page import write_results
        from evaluation.show.report.screen import print_summary

        plan = self.plan() if self.suite is None else self.suite_plan(self.suite)
        setup, seed, level = plan.setups[0], self.checked_seed(), self._level()
        with (
            resumable_folder(self.out) as folder,
            Crew(self.cluster, self.workers(), plan.tasks(), folder.scratch) as crew,
        ):
            recordings = self.recordings or folder.recordings
            announce(
                f"measures {plan.tasks()} passes over {len(plan.flights)} flights",
                work_s(self._core_s(plan, recordings), self.workers()),
            )
            found = plan.measured(None if self.render else recordings, folder.store, crew)
            mark = None if level is None else level.mark
            results = Results(found.table, setup.config, seed, found.showcase, level=mark)
            with step("writing the report"):
                summary = write_results(results, folder.results)
        print_summary(summary)

    def suite_plan(self, name: SuiteName) -> Plan:
        """What the suite of this name measures, checked."""
        from evaluation.measure.suite import SUITES
        from evaluation.setup.settings import ProtocolCounts
        from sim.sensors.presets import sensor_preset

        suite = SUITES[name]
        for field in ("budget", "scenes", "flights", "sequences"):
            if getattr(self, field):
                raise InputError(f"--{field}: the suite {name} is fixed; give it without --suite")
        if self.alone:
            raise InputError(f"--alone: the suite {name} has one setup anyway; leave it out")
        if suite.sensors is not None and self.sensors:
            raise InputError(f"--sensors: the suite {name} fixes it; give it without --suite")
        if suite.heading is not None:
            self._refuse_heading(f"the suite {name}", "--suite")
        asked = self if suite.heading is None else replace(self, north=suite.heading)
        if asked.settings().protocol != ProtocolCounts():
            raise InputError(f"section protocol: the suite {name} is fixed")
        sensors = sensor_preset(suite.sensors or self.sensors or FULL.sensors)
        return suite.plan(asked.setup(), sensors, self.checked_seed())

    def plan(self) -> Plan:
        """What the words ask for, checked."""
        from evaluation.measure.plans.reproduce import Plan
        from evaluation.setup.setups import with_companions

        level = self._level()
        asked = self if level is None else replace(self, north=level.heading)
        setup = asked.setup()
        if self.budget and setup.poses != "slam":
            raise InputError("--budget asks what SLAM loses among others; give --poses slam")
        extent = self._extent(setup.config.preset, level)
        setups = [setup] if self.alone else with_companions(setup, few=self.quick)
        return Plan(
            flights=self._flights(extent, level),
            setups=setups if level is None else level.under(setups),
            protocol=asked._protocol(extent),
            budget=self.budget,
            negatives=extent.negatives,
            sequences=int(in_range("--sequences", self.sequences or 0)),
        )

    def _level(self) -> Level | None:
        """The level asked for; refuses what it fixes."""
        from evaluation.measure.levels.level import load_level

        if self.level is None:
            return None
        for word, given in {"scenes": self.scenes, "sensors": self.sensors}.items():
            if given:
                raise InputError(f"--{word}: level {self.level} fixes it; give it without --level")
        self._refuse_heading(f"level {self.level}", "--level")
        return load_level(self.level)

    def _refuse_heading(self, what: str, option: str) -> None:
        """Raise InputError if words say where the heading comes from, which `what` fixes."""
        asked = {
            "heading": self.north,
            "set localization.heading": self.sets("localization.heading"),
        }
        for word, given in asked.items():
            if given:
                raise InputError(f"--{word}: {what} fixes it; give it without {option}")

    def _flights(self, extent: Extent, level: Level | None) -> list[Flight]:
        from evaluation.measure.plans.reproduce import flights_over
        from sim.scene import load_scene
        from sim.sensors.presets import sensor_preset

        count, seed = self._count("--flights", self.flights, extent.flights), self.checked_seed()
        if level is not None:
            return level.flown(count, seed)
        scenes = [load_scene(name) for name in self.scenes or extent.scenes]
        sensors = sensor_preset(self.sensors or extent.sensors)
        return flights_over(scenes, count, sensors, seed, extent.heaps)

    def _extent(self, preset: str, level: Level | None) -> Extent:
        if level is not None:
            return Extent(**{field.name: getattr(level, field.name) for field in fields(Extent)})
        sensors = FULL.sensors if preset == "best" else TWIN.sensors
        if self.quick:
            return replace(QUICK, sensors=sensors)
        return FULL if preset == "best" else TWIN

    def _protocol(self, extent: Extent) -> Protocol:
        from evaluation.measure.protocol.trials import Protocol

        asked = self.settings().protocol
        return Protocol(
            sequences=self._count(
                "sequences_per_flight", asked.sequences_per_flight, extent.sequences
            ),
            trials=self._count("trials", asked.trials, extent.trials),
            baselines=self._count("baselines", asked.baselines, extent.baselines, low=0),
            only_images=extent.only_images if asked.only_images is None else asked.only_images,
        )

    def _count(self, word: str, asked: int | None, usual: int, low: int = 1) -> int:
        return usual if asked is None else int(in_range(word, asked, low=low))

    def _core_s(self, plan: Plan, recordings: Path) -> float:
        """Work to be expected at most, for what is finished already is not done again [s]."""
        from evaluation.measure.work.measure import recording_name

        def seconds(flights: list[Flight]) -> float:
            return sum(flight.duration_s or flight.scene.duration_s for flight in flights)

        flights = plan.certain_flights()
        missing = [f for f in flights if not (recordings / recording_name(f)).exists()]
        measured_s = seconds(flights) * plan.tasks() / len(flights)
        rendered_s = measured_s if self.render else seconds(missing)
        return rendered_s * RENDER_S_PER_S + measured_s * MEASURE_S_PER_S
