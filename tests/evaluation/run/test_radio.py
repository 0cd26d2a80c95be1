"""Arrival and loss of messages on a limited radio link."""

from __future__ import annotations

import numpy as np
import pytest

from evaluation.run.live.radio_link import Radio, RadioLimits

MS = 1_000_000


def sent(limits: RadioLimits, count: int, size: int, every_ms: int = 33) -> list[int | None]:
    radio = Radio(limits, np.random.default_rng(0))
    return [radio.transmit(i * every_ms * MS, size) for i in range(count)]


def test_without_limits_messages_arrive_at_once() -> None:
    assert sent(RadioLimits(), 3, 10**6) == [0, 33 * MS, 66 * MS]


def test_a_message_takes_its_bits_over_the_rate_and_the_latency() -> None:
    limits = RadioLimits(mbit_s=8.0, latency_ms=20.0)
    assert sent(limits, 2, 10_000) == [30 * MS, 63 * MS]


def test_messages_queue_for_half_a_second_and_are_then_lost() -> None:
    arrivals = sent(RadioLimits(mbit_s=8.0), 200, 66_000)  # twice what the link carries
    lost = [arrival is None for arrival in arrivals]
    assert not any(lost[:10])
    assert 0.4 < np.mean(lost[50:]) < 0.6
    waits = [a - i * 33 * MS for i, a in enumerate(arrivals) if a is not None]
    assert max(waits) <= (500 + 66 + 1) * MS


def test_the_share_of_losses_is_the_set_one_and_the_same_every_time() -> None:
    limits = RadioLimits(loss=0.2)
    arrivals = sent(limits, 2000, 100)
    assert np.mean([arrival is None for arrival in arrivals]) == pytest.approx(0.2, abs=0.03)
    assert arrivals == sent(limits, 2000, 100)


def test_a_message_lost_at_random_occupies_the_link() -> None:
    radio = Radio(RadioLimits(mbit_s=8.0, loss=1.0), np.random.default_rng(0))
    assert radio.transmit(0, 10_000) is None
    assert radio.carried_bytes == 10_000
    assert radio._free_ns == 10 * MS


def test_a_message_that_waits_too_long_does_not_occupy_the_link() -> None:
    radio = Radio(RadioLimits(mbit_s=8.0), np.random.default_rng(0))
    assert radio.transmit(0, 600_000) == 600 * MS
    assert radio.transmit(MS, 600_000) is None
    assert radio.carried_bytes == 600_000
