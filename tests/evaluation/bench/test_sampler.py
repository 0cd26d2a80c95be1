"""Turns are taken one after the other, and ratios stand what changes during a run."""

from __future__ import annotations

import pytest

from evaluation.bench.work import LEAST_ROUNDS, Sample, Work, interleaved, take_turn, wall_ratio


def test_a_turn_prepares_each_call_and_times_at_least_one() -> None:
    calls: list[str] = []
    work = Work(lambda: calls.append("run"), lambda: calls.append("before"))
    samples = take_turn(work, 0.0)
    assert calls == ["before", "run"]
    assert len(samples) == 1
    calls.clear()
    samples = take_turn(work, 0.01)
    assert calls == ["before", "run"] * len(samples)
    assert len(samples) > 10


def test_contenders_alternate_and_the_first_round_is_not_counted() -> None:
    order: list[str] = []

    def contender(name: str):
        def take(seconds: float) -> list[Sample]:
            order.append(name)
            return [Sample(1.0, 1.0)]

        return take

    turns = interleaved({name: contender(name) for name in "abc"}, 0.0)
    assert "".join(order) == "abc" * (1 + LEAST_ROUNDS)
    assert {name: len(taken) for name, taken in turns.items()} == dict.fromkeys("abc", 3)


def test_turns_share_the_time() -> None:
    given: list[float] = []

    def take(seconds: float) -> list[Sample]:
        given.append(seconds)
        return [Sample(1.0, 1.0)]

    interleaved({0: take, 1: take}, 0.012)
    assert given[:2] == [0.0, 0.0]
    assert set(given[2:]) == {0.001}


def test_a_ratio_ignores_load_that_hits_whole_rounds() -> None:
    slowdowns = (1.0, 4.0, 2.0, 8.0, 1.0)
    ours = [[Sample(10.0 * s, 10.0)] * 3 for s in slowdowns]
    peer = [[Sample(30.0 * s, 30.0)] for s in slowdowns]
    assert wall_ratio(peer, ours) == pytest.approx(3.0)
