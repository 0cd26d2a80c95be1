"""What is known of an accelerometer's bias and of the vertical goes into adjustment once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from airground.config import MonocularSlam
from airground.slam.keyframe_slam import KeyframeSlam
from airground.slam.spread_adjustment import SpreadAdjustment
from tests.slam import bundle_problems
from tests.slam.driven_slam import CALIBRATION
from tests.slam.inertial_motion import ADIS16448
from tests.slam.test_map_adjustment import adjuster_of, map_of
from tests.slam.test_spread_adjustment import finish


def test_a_vertical_that_is_adjusted_is_not_in_the_covariance() -> None:
    """It is stated for the whole map; until the window has left the beginning, it moves."""
    for count, stated in [(4, False), (6, True)]:
        problem = bundle_problems.make(count, 200, 80)
        covariance = adjuster_of(map_of(problem), problem).adjust_window(True)
        assert (covariance is not None) == stated


@pytest.mark.parametrize("way", ["window", "at once", "in pieces"])
def test_a_bias_is_as_large_as_it_is_known_to_be(way: str) -> None:
    """Motions that say it is 0.2 m/s^2 bend a map that knows better less."""
    found = []
    for bias_sigma in (1e-3, 0.05, 10.0):
        problem = bundle_problems.make(5, 200, 80)
        sparse_map = map_of(problem)
        for keyframe in sparse_map.keyframes:
            keyframe.state = replace(keyframe.state, accelerometer_bias=np.array([0.2, 0.0, 0.0]))
        adjuster = adjuster_of(sparse_map, problem)
        adjuster.bias_sigma = bias_sigma
        match way:
            case "window":
                adjuster.adjust_window(True)
            case "at once":
                adjuster.adjust_all(True)
            case _:
                finish(SpreadAdjustment(sparse_map, adjuster, True))
        found.append(float(np.linalg.norm(sparse_map.keyframes[0].state.accelerometer_bias)))
    assert found[0] < 5e-3
    assert found[0] < found[1] < found[2]


def test_what_a_calibration_states_reaches_adjustment_also_of_a_new_map() -> None:
    imu = replace(ADIS16448, stated_bias_sigma=0.02)
    slam = KeyframeSlam(replace(CALIBRATION, imu=imu), MonocularSlam(), np.random.default_rng(0))
    assert slam.adjuster.bias_sigma == 0.02
    slam.reset()
    assert slam.adjuster.bias_sigma == 0.02
