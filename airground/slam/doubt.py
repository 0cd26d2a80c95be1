"""A place that was found where nothing before leads to: believed when images confirm it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from airground.core.se3 import SE3, rotation_angle
from airground.slam.rig_state import RigState

MAX_JUMP_M = 0.25
"""No robot here moves so far between prediction and measurement from image to image."""
MAX_DRIFT_MPS = 0.1
"""Nobody knows how fast it went on while nothing was seen; this much error adds up."""
MAX_TURN_RAD = np.deg2rad(5.0)
"""A gyro is not off by so much, not even after seconds."""
CONFIRMATIONS = 3
"""Images that must be tracked from a surprising place before it counts."""


def jumps(T_map_camera: SE3, expected: SE3, more_m: float = 0.0) -> bool:
    """Whether a pose is too far from where it was expected; `more_m` adds to the limit."""
    off = float(np.linalg.norm(T_map_camera.translation - expected.translation))
    return off > MAX_JUMP_M + more_m


def surprising(T_map_camera: SE3, expected: SE3, unseen_s: float) -> bool:
    """Whether a pose is not where the robot's motion would have carried it.

    Args:
        T_map_camera: As found.
        expected: As predicted.
        unseen_s: How long the prediction is without a look at the scene [s].
    """
    turn = rotation_angle(T_map_camera.rotation.T @ expected.rotation)
    return jumps(T_map_camera, expected, MAX_DRIFT_MPS * unseen_s) or turn > MAX_TURN_RAD


@dataclass(eq=False)
class Doubt:
    """What to go back to if images do not confirm a place.

    Attributes:
        state: The state before it was found ...
        stamp_ns, seen_ns: ... of which image, and the last one before that gave a pose.
        found_state: The state that is in doubt ...
        found_ns: ... and of which image.
        confirmations: Images tracked from there.
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
