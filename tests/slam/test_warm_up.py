"""After the warm-up nothing is compiled any more while images wait."""

from __future__ import annotations

import importlib
import pkgutil

import numpy as np
from numba.core.registry import CPUDispatcher

import airground.slam
from airground.config import Config
from airground.slam.monocular import MonocularSlam
from airground.slam.rgbd import RgbdSlam
from airground.slam.warm_up import warm_up_slam
from tests.slam.synthetic_world import ground_sequence, mav_sequence


def compiled() -> dict[str, int]:
    """Signatures compiled so far, by kernel of the room."""
    kernels = {}
    for found in pkgutil.walk_packages(airground.slam.__path__, "airground.slam."):
        for name, value in vars(importlib.import_module(found.name)).items():
            if isinstance(value, CPUDispatcher):
                kernels[f"{value.__module__}.{name}"] = len(value.signatures)
    return kernels


def test_tracking_compiles_nothing_after_the_warm_up() -> None:
    warm_up_slam(np.random.default_rng(0))
    before = compiled()
    assert sum(before.values()) > 20
    ground = ground_sequence().darkened(30, 33)
    ground.feed(RgbdSlam(ground.calibration, Config(), np.random.default_rng(0)))
    mav = mav_sequence(96, 20.0)
    mav.feed(MonocularSlam(mav.calibration, Config(), np.random.default_rng(0)))
    assert compiled() == before
