"""A small scene and two floors for tests of motion; no boxes, no pictures."""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.robots.motion import Motion, simulate_motion
from sim.scene import GroundPath, MavPath, Room, Scene
from sim.world.world import World

STEP_S = 0.005
MAV: dict[str, Any] = {
    "start": (-1.0, -1.0),
    "takeoff_s": 1.0,
    "waypoints": [(-1.0, -1.0), (-1.0, 1.0), (0.0, 1.0), (0.0, -1.0)],
}
GROUND: dict[str, Any] = {"waypoints": [(-1.5, 0.0, 0.0), (0.5, 0.0, 20.0), (0.5, 1.0, 110.0)]}


@dataclass(frozen=True)
class Floor:
    """A floor with gentle waves, 6 m wide."""

    wave_m: float

    def floor_height(self, x: ArrayLike, y: ArrayLike) -> NDArray[np.float64]:
        x, y = np.asarray(x, float), np.asarray(y, float)
        inside = (np.abs(x) <= 3) & (np.abs(y) <= 3)
        return np.where(inside, self.wave_m * np.sin(2 * x + y), np.nan)


def small_scene(mav: dict[str, Any] | None = None, ground: dict[str, Any] | None = None) -> Scene:
    return Scene(
        name="small",
        description="For tests of motion.",
        kind="flat",
        duration_s=14.0,
        overlap_expected=0.5,
        room=Room(size_m=(6.0, 6.0)),
        mav=MavPath(**{**MAV, **(mav or {})}),
        ground=GroundPath(**{**GROUND, **(ground or {})}),
    )


def simulate(
    scene: Scene, seed: int = 0, duration_s: float | None = None, wave_m: float = 0.03
) -> Motion:
    return simulate_motion(cast(World, Floor(wave_m)), scene, seed, duration_s)
