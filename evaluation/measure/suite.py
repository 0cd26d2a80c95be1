"""The regression suites: fixed, small, meant to run on every change.

Each has many short flights over different heaps instead of one long flight, since only flights are
independent. With all metrics watched (`judge.verdict`), ten flights are the fewest that can give
a verdict, and only if all agree; with twelve, one may differ a little.

`fast` shows what a change does where all goes well, `hard` where today's best fails often, and
`faults` where sensors fail.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from airground.config import Config
from evaluation.measure.levels.level import load_level
from evaluation.measure.plans.dials import Subject, turned
from evaluation.measure.plans.reproduce import Plan
from evaluation.measure.protocol.trials import Protocol
from evaluation.setup.setups import Setup
from sim.recording.recorder import Flight
from sim.scene import load_scene
from sim.sensors.presets import SensorPreset

SuiteName = Literal["fast", "hard", "faults"]

SEEDS_APART = 100
"""Seed n of a suite draws heaps n * 100, n * 100 + 1, ...: other seeds give other heaps."""


@dataclass(frozen=True)
class Flights:
    """Some flights over one scene, each over a heap of its own and cut after `duration_s`, with
    the simulator's `dials` turned."""

    scene: str
    count: int
    duration_s: float
    dials: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Suite:
    """Flights, and the extent of the measurements on each.

    Attributes:
        variant: How rows name it, so that they are held against results of the same suite alone;
            empty where scenes, sensors and heading say it all.
        sensors, heading: Sensor preset, and "known" or "search"; None where the user chooses.
    """

    flights: tuple[Flights, ...]
    protocol: Protocol
    variant: str = ""
    sensors: str | None = None
    heading: Literal["known", "search"] | None = None

    def plan(self, setup: Setup, sensors: SensorPreset, seed: int) -> Plan:
        """The plan that measures one setup; `seed` is that of heaps, flights, noise and
        particles."""
        flown: Counter[str] = Counter()
        flights: list[Flight] = []
        for some in self.flights:
            subject = turned(Subject(load_scene(some.scene), sensors, Config()), some.dials)
            for number in range(flown[some.scene], flown[some.scene] + some.count):
                flight = Flight(
                    subject.scene,
                    SEEDS_APART * seed + number,
                    0,
                    subject.sensors,
                    some.duration_s,
                    some.dials or None,
                )
                flights.append(flight)
            flown[some.scene] += some.count
        named = replace(setup, variant=self.variant or setup.variant)
        return Plan(flights, [named], self.protocol, negatives=False)


# Verdicts look at aerial maps 1 and 4.
_PROTOCOL = Protocol(sequences=3, trials=4, sequence_length=4, wide_searches=6)
_CONTROL = Flights("flat", 1, 24.0)
"""Nothing to find: every claimed position is wrong."""

_HARD = load_level("hard")
# 0.40 to 0.48 are seen over `tiny` as the robot sets off (seeds 0 to 11), 0.71 to 0.85 in the end.
_HARD_DIALS = _HARD.dials | {"scene.overlap": 0.52, "scene.changed": 0.15}

_FAULTS = (
    {"sensors.dropped_s": 1.0},
    {"sensors.dropped_s": 3.0},
    {"sensors.black_s": 1.0},
    {"sensors.frozen_s": 0.5},
    {"sensors.frozen_s": 2.0},
    {"sensors.repeated_s": 5.0},
    {"sensors.overexposed_s": 2.0},
    {"sensors.depth_gone_s": 2.0},
    {"sensors.imu_gap_s": 1.0},
    {"sensors.imu_saturated_s": 0.5},
    {"sensors.imu_silent_s": 2.0},
    {"sensors.clock_step_s": 0.2},
)

SUITES: Mapping[SuiteName, Suite] = {
    "fast": Suite((Flights("tiny", 12, 20.0), _CONTROL), _PROTOCOL),
    "hard": Suite(
        (Flights("tiny", 12, 20.0, _HARD_DIALS), _CONTROL),
        _PROTOCOL,
        variant="suite hard",
        sensors=_HARD.sensors,
        heading=_HARD.heading,
    ),
    "faults": Suite(
        (
            *(Flights("tiny", 1, 20.0, fault) for fault in _FAULTS),
            replace(_CONTROL, dials=_FAULTS[0]),
        ),
        _PROTOCOL,
        variant="suite faults",
        sensors="nominal",
        heading="known",
    ),
}
