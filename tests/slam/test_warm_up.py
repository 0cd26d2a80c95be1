"""After the warm-up nothing is compiled any more while images wait."""

from __future__ import annotations

import numpy as np

from airground.config import Config
from airground.slam.monocular import MonocularSlam
from airground.slam.rgbd import RgbdSlam
from airground.slam.warm_up import warm_up_slam
from tests.compiled_kernels import compiled
from tests.slam.synthetic_world import ground_sequence, mav_sequence


def test_tracking_compiles_nothing_after_the_warm_up() -> None:
    warm_up_slam(np.random.default_rng(0))
    before = compiled("airground.slam")
    assert sum(before.values()) > 20
    ground = ground_sequence().darkened(30, 33)
    ground.feed(RgbdSlam(ground.calibration, Config(), np.random.default_rng(0)))
    mav = mav_sequence(96, 20.0)
    mav.feed(MonocularSlam(mav.calibration, Config(), np.random.default_rng(0)))
    assert compiled("airground.slam") == before
