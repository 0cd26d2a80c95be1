"""A hand-held depth camera with a rolling shutter, turning on the spot."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from airground.config import Config
from airground.slam.rgbd import RgbdSlam
from tests.slam.hand_held import Hand, sequence
from tests.slam.synthetic_world import Sequence


@cache
def turning() -> Sequence:
    return sequence(3.0, Hand())


def errors_m(made: Sequence) -> np.ndarray:
    """(N,) position errors of the final trajectory, on the first pose [m]."""
    slam = RgbdSlam(made.calibration, Config(), np.random.default_rng(0))
    tracked = made.feed(slam)
    assert all(answer.T_map_camera is not None for answer in tracked)
    final = slam.trajectory()
    assert final is not None
    T_world_map = made.T_world_camera[0] @ final[0].inverse()
    found = T_world_map @ final.translations
    return np.linalg.norm(found - made.T_world_camera.translations, axis=1)


@pytest.mark.slow
def test_a_known_readout_time_halves_the_error() -> None:
    made = turning()
    as_if_global = replace(made, calibration=replace(made.calibration, readout_s=0.0))
    known, ignored = errors_m(made), errors_m(as_if_global)
    assert np.sqrt(np.mean(known**2)) < 0.5 * np.sqrt(np.mean(ignored**2))
    assert np.sqrt(np.mean(known**2)) < 0.03
