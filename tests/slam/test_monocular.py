"""What the MAV's front end forgets with a map that it gives up."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from evo.core.geometry import umeyama_alignment

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


def test_a_short_clip_gives_final_poses_back_to_its_first_image() -> None:
    """Too short for live poses, it leaves those of all images, after `finish` and not before."""
    sequence = mav_sequence(frames=96, rate_hz=20.0)
    clip = replace(sequence, images=sequence.images[20:60])
    front_end = MonocularSlam(sequence.calibration, Config(), np.random.default_rng(0))
    previous = clip.images[0].stamp_ns - 10**7
    for image in clip.images:
        front_end.add_imu(sequence.imu.between(previous, image.stamp_ns))
        answer = front_end.track(image)
        previous = image.stamp_ns
        assert answer.tracking is Tracking.INITIALIZING
        assert front_end.trajectory() is None
    front_end.finish()
    path = front_end.trajectory()
    assert path is not None
    assert path.stamps_ns.tolist() == [image.stamp_ns for image in clip.images]
    true = np.array([sequence.T_world_camera.at(int(t)).translation for t in path.stamps_ns])
    _, _, scale = umeyama_alignment(path.translations.T, true.T, with_scale=True)
    turn, shift, _ = umeyama_alignment(scale * path.translations.T, true.T)
    off = turn @ (scale * path.translations.T) + shift[:, None] - true.T
    assert np.sqrt((off**2).sum(axis=0).mean()) < 0.01
