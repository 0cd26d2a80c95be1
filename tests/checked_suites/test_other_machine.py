"""Flights of another machine are as good within a margin, which faults go beyond."""

from __future__ import annotations

from pathlib import Path

import pytest

from evaluation.judge.accepted import Measured
from evaluation.judge.metrics import WATCHED
from evaluation.judge.samples import Flight
from evaluation.measure.suite import SUITES
from tests.checked_suites.figures import FILE, Checked
from tests.checked_suites.other_machine import as_good, worse_metrics
from tests.checked_suites.test_sample import TABLE
from tests.machine import machine

HERE = Flight("tiny", 0, 0)
BY_NAME = {metric.name: metric for metric in WATCHED}


def measured(name: str, flights: list[list[float]]) -> Measured:
    """Flights over `tiny` with these values of one metric, and nothing of the others."""
    samples = {metric.name: {} for metric in WATCHED}
    samples[name] = {Flight("tiny", seed, 0): values for seed, values in enumerate(flights)}
    condition = Measured.of(TABLE).condition
    return Measured("tiny", condition, list(samples[name]), samples)


@pytest.mark.parametrize(
    ("name", "before", "worst"),
    [
        # Half of the range of 1 cm and 3 cm.
        ("localization_4", [[0.01], [0.03]], 0.04),
        # All the same: what matters, 5 % of the figure.
        ("localization_4", [[0.02], [0.02]], 0.021),
        ("within_25cm_4", [[1.0, 1.0], [0.0, 1.0]], 0.25),
        ("aerial_maps", [[7.0], [7.0]], 6.0),
    ],
)
def test_the_margin_is_beyond_the_worst_flight(
    name: str, before: list[list[float]], worst: float
) -> None:
    metric = BY_NAME[name]
    known = measured(name, before)
    further = 1e-6 if metric.better == "lower" else -1e-6
    assert as_good(known, measured(name, [[worst - further]]), HERE)
    found = measured(name, [[worst + further]])
    assert list(worse_metrics(known, found, HERE)) == [name]


def test_a_wrong_claim_is_beyond_chance() -> None:
    never = measured("located_wrongly", [[0.0] * 12] * 10)
    once = measured("located_wrongly", [[0.0] * 11 + [1.0]])
    assert not as_good(never, once, HERE)


def test_a_flight_that_failed_is_no_better_where_none_failed() -> None:
    right, failed = measured("localization_4", [[0.01], [0.02]]), float("inf")
    assert not as_good(right, measured("localization_4", [[failed]]), HERE)
    both = measured("localization_4", [[0.01], [failed]])
    assert as_good(both, measured("localization_4", [[failed]]), HERE)


def test_a_metric_that_one_side_lacks_is_not_as_good() -> None:
    known = measured("localization_4", [[0.01], [0.02]])
    assert not as_good(known, measured("localization_1", [[0.01]]), HERE)


@pytest.mark.parametrize("name", sorted(SUITES))
def test_the_flights_that_passed_are_as_good_as_themselves(name: str) -> None:
    kept = Checked.read(FILE).suites[name].measured()  # type: ignore[index]
    assert all(as_good(kept, kept, flight) for flight in kept.flights)


def test_a_machine_is_its_processor(tmp_path: Path) -> None:
    cpuinfo = tmp_path / "cpuinfo"
    core = "processor : {0}\nmodel name : A\nflags : fpu {1}\ncpu MHz : {0}\n\n"
    names = []
    for text in (core.format(0, "avx2"), core.format(1, "avx2"), core.format(0, "avx512f")):
        cpuinfo.write_text(text + text)
        names.append(machine(cpuinfo))
    assert names[0] == names[1] != names[2]
    assert len(machine(tmp_path / "missing")) == 16
