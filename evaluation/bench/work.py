"""Work to time, and contenders timed in turns, so that other load hits all of them alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from evaluation.bench.floors import Floor

ROUNDS = 6
"""Rounds aimed at: each contender has its turn once per round."""
LEAST_ROUNDS = 3


@dataclass(frozen=True, eq=False)
class Work:
    """Something to time: `before` prepares each call and is not timed; `size` is in words."""

    run: Callable[[], object]
    before: Callable[[], object] = lambda: None
    size: str = ""
    floor: Floor | None = None


@dataclass(frozen=True)
class Sample:
    """One call: time by the clock, and processor time of the process, all threads together."""

    wall_ms: float
    cpu_ms: float


Turn = list[Sample]
Key = TypeVar("Key", bound=Hashable)


def take_turn(work: Work, seconds: float) -> Turn:
    """Call the work once, and again until the time is up."""
    samples = []
    ends = time.perf_counter() + seconds
    while True:
        work.before()
        cpu, wall = time.process_time(), time.perf_counter()
        work.run()
        now = time.perf_counter()
        samples.append(Sample(1e3 * (now - wall), 1e3 * (time.process_time() - cpu)))
        if now >= ends:
            return samples


def interleaved(
    contenders: Mapping[Key, Callable[[float], Turn]], seconds: float
) -> dict[Key, list[Turn]]:
    """Let contenders take turns until the time is up, and at least `LEAST_ROUNDS` times.
    `seconds` is the time for all of them together, without the first turns, which compile. Each
    contender has one turn per round."""
    for take in contenders.values():
        take(0.0)
    share = seconds / (ROUNDS * len(contenders))
    turns: dict[Key, list[Turn]] = {key: [] for key in contenders}
    ends = time.perf_counter() + seconds
    rounds = 0
    while rounds < LEAST_ROUNDS or time.perf_counter() < ends:
        for key, take in contenders.items():
            turns[key].append(take(share))
        rounds += 1
    return turns


def wall_ratio(turns: list[Turn], base: list[Turn]) -> float:
    """Ratio of two contenders' times: the median over rounds of the rounds' medians."""
    ratios = [_median(turn) / _median(other) for turn, other in zip(turns, base, strict=True)]
    return float(np.median(ratios))


def _median(turn: Turn) -> float:
    return float(np.median([sample.wall_ms for sample in turn]))
