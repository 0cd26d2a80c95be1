"""The probes' kernels do the work that is counted for them."""

from __future__ import annotations

import numpy as np
import pytest

from evaluation.bench import machine


@pytest.mark.kernel
def test_the_triad_adds_and_multiplies() -> None:
    rng = np.random.default_rng(0)
    a, b, c = np.zeros(1000), rng.normal(size=1000), rng.normal(size=1000)
    machine.triad(a, b, c)
    np.testing.assert_allclose(a, b + 3.0 * c)


@pytest.mark.kernel
def test_multiply_add_does_all_its_repeats() -> None:
    values = np.random.default_rng(1).uniform(0, 2, (2, machine.VALUES)).astype(np.float32)
    expected = values.astype(np.float64)
    for _ in range(3 * machine.CHAIN):
        expected = expected * 0.999 + 0.001
    machine.multiply_add(values, 3)
    np.testing.assert_allclose(values, expected, rtol=1e-5)


def test_a_machine_moves_and_computes_something() -> None:
    speed = machine.probe()
    assert 0.1 < speed.bandwidth_gb_s < 1e4
    assert 0.1 < speed.arithmetic_gflop_s < 1e6
