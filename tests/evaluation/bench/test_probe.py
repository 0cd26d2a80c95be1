"""The probes' kernels do the work that is counted for them."""

from __future__ import annotations

import numpy as np
import pytest

from evaluation.bench import probe


@pytest.mark.kernel
def test_the_triad_adds_and_multiplies() -> None:
    rng = np.random.default_rng(0)
    a, b, c = np.zeros(1000), rng.normal(size=1000), rng.normal(size=1000)
    probe.triad(a, b, c)
    np.testing.assert_allclose(a, b + 3.0 * c)


@pytest.mark.kernel
def test_multiply_add_does_all_its_repeats() -> None:
    values = np.random.default_rng(1).uniform(0, 2, (2, probe.VALUES)).astype(np.float32)
    expected = values.astype(np.float64)
    for _ in range(3 * probe.CHAIN):
        expected = expected * 0.999 + 0.001
    probe.multiply_add(values, 3)
    np.testing.assert_allclose(values, expected, rtol=1e-5)


def test_a_machine_moves_and_computes_something() -> None:
    speed = probe.probe()
    assert 1e8 < speed.bytes_per_s < 1e13
    assert 1e8 < speed.operations_per_s < 1e15
