"""After the warm-up nothing above tracking is compiled any more while frames wait."""

from __future__ import annotations

import importlib
import pkgutil

import numpy as np
import pytest
from numba.core.registry import CPUDispatcher

import airground
from airground.config import Config
from airground.warm_up import warm_up_mapping
from tests.test_pipeline import Recorded


def compiled() -> dict[str, int]:
    """Signatures compiled so far, by kernel of the rooms above tracking."""
    kernels = {}
    for found in pkgutil.walk_packages(airground.__path__, "airground."):
        if not found.name.startswith("airground.slam"):
            for value in vars(importlib.import_module(found.name)).values():
                if isinstance(value, CPUDispatcher):
                    kernels[f"{value.__module__}.{value.__name__}"] = len(value.signatures)
    return kernels


@pytest.mark.slow
def test_mapping_compiles_nothing_after_the_warm_up() -> None:
    warm_up_mapping(Config(), np.random.default_rng(0))
    before = compiled()
    assert sum(before.values()) > 10
    Recorded().run()
    assert compiled() == before
