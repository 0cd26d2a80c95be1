"""What the MAV's front end forgets with a map that it gives up."""

from __future__ import annotations

import re

import numpy as np
import pytest

from airground.config import Config, paper
from airground.slam.front_end import Tracking
from airground.slam.monocular import MonocularSlam
from tests.slam.synthetic_world import mav_sequence

DARK = 22
"""The first dark image: a map has begun, its scale is not known yet."""


@pytest.mark.parametrize("config", [Config(), paper()], ids=["tight", "filter"])
def test_a_map_given_up_takes_all_that_was_known_of_its_unit_along(config: Config) -> None:
    whole = mav_sequence(frames=96, rate_hz=20.0)
    sequence = whole.darkened(DARK, len(whole.images))
    front_end = MonocularSlam(sequence.calibration, config, np.random.default_rng(0))
    begun, answers, waiting = [], [], []
    previous = 0
    for image in sequence.images:
        front_end.add_imu(sequence.imu.between(previous, image.stamp_ns))
        answer = front_end.track(image)
        answers.append(answer.tracking)
        waiting.append(answer.waiting)
        begun.append(front_end._slam.begun)
        previous = image.stamp_ns
    assert begun[DARK - 1]
    assert not begun[-1]
    assert set(answers) == {Tracking.INITIALIZING}
    assert re.match(r"the scale: .*\d keyframes in \d\.\d s", waiting[DARK - 1])
    expected = (
        "a first view with corners: 0 in the newest, 30 are needed (a map was given up before)"
    )
    assert waiting[-1] == expected
    # What begins now is between two views, in an unknown unit.
    assert not front_end._slam.metric
    assert not front_end._slam.inertial
    assert not front_end._scale.known
    assert front_end._scale.estimate is None
