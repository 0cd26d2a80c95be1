"""A relocalization far from the prediction is accepted only when further images confirm it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from airground.core.se3 import SE3, rotation_angle
from airground.slam.rig_state import RigState

MAX_JUMP_M = 0.25
"""Largest distance from the prediction of one image [m]: no robot here moves farther."""
MAX_DRIFT_MPS = 0.1
"""Growth of that distance while nothing is seen and the velocity is unknown [m/s]."""
MAX_TURN_RAD = np.deg2rad(5.0)
"""Largest turn from the prediction [rad]: more than a gyro's error after seconds."""
CONFIRMATIONS = 3
"""Images that must be tracked from a surprising place before it is accepted."""


def jumps(T_map_camera: SE3, expected: SE3, more_m: float = 0.0) -> bool:
    """Whether a pose is too far from where it was expected; `more_m` adds to the limit."""
    off = float(np.linalg.norm(T_map_camera.translation - expected.translation))
    return off > MAX_JUMP_M + more_m


def surprising(T_map_camera: SE3, expected: SE3, unseen_s: float) -> bool:
    """Whether a pose is not where motion carries the robot in `unseen_s` without a pose [s]."""
    turn = rotation_angle(T_map_camera.rotation.T @ expected.rotation)
    return jumps(T_map_camera, expected, MAX_DRIFT_MPS * unseen_s) or turn > MAX_TURN_RAD


@dataclass(eq=False)
class Doubt:
    """The state to return to if images do not confirm a place.

    Attributes:
        state: State before the place was found.
        stamp_ns, seen_ns: Stamps of that state's image and of the last image with a pose [ns].
        found_state: State in doubt.
        found_ns: Stamp of its image [ns].
        confirmations: Number of images tracked from there.
    """

    state: RigState
    stamp_ns: int
    seen_ns: int
    found_state: RigState
    found_ns: int
    confirmations: int = 0

    @property
    def settled(self) -> bool:
        """Whether enough images confirmed the place."""
        return self.confirmations >= CONFIRMATIONS

    def with_velocity(self, state: RigState, stamp_ns: int) -> RigState:
        """`state` with the velocity since the place was found: the one before is not its own."""
        seconds = (stamp_ns - self.found_ns) * 1e-9
        moved = state.position - self.found_state.position
        return replace(state, velocity=moved / seconds)
