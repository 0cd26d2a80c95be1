"""After the warm-up nothing is compiled any more while images wait."""

from __future__ import annotations

import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

from airground.config import Config
from airground.core.cloud import Source
from airground.slam.monocular import MonocularSlam
from airground.slam.rgbd import RgbdSlam
from airground.slam.warm_up import warm_up_slam
from tests.compiled_kernels import compiled
from tests.slam.synthetic_world import ground_sequence, mav_sequence


@pytest.mark.parametrize("robot", list(Source))
def test_tracking_compiles_nothing_after_the_warm_up(robot: Source) -> None:
    """In a process of its own, as tracking: this one may have compiled for both robots."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        before, after = pool.submit(_compiled_before_and_after, robot).result()
    assert sum(before.values()) > 20
    assert after == before


def _compiled_before_and_after(robot: Source) -> tuple[dict[str, int], dict[str, int]]:
    """What the robot's warm-up compiles, and what is compiled once it has tracked."""
    warm_up_slam(np.random.default_rng(0), (robot,))
    before = compiled("airground.slam")
    if robot is Source.GROUND:
        ground = ground_sequence().darkened(30, 33)
        ground.feed(RgbdSlam(ground.calibration, Config(), np.random.default_rng(0)))
    else:
        mav = mav_sequence(96, 20.0)
        mav.feed(MonocularSlam(mav.calibration, Config(), np.random.default_rng(0)))
    return before, compiled("airground.slam")
