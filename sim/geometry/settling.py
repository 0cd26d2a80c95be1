"""Boxes fall and settle by physics, while the ground robot's lane is kept free."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.core.se3 import SE3
from sim.geometry.box import Box
from sim.geometry.lane import distance_to_footprint, lane_points
from sim.geometry.surface import BOX_CORNERS
from sim.scene import MAX_HEAP_HEIGHT_M, Rubble, Scene

ROUNDS = 6
"""Boxes that came to lie wrong are thrown again so often."""
SETTLE_S = 4.0
SETTLED_MPS = 0.02
_PARKED_M = 200.0
_PILE_SPREAD_M = 0.35
_HOME_SPREAD_M = 0.25  # a box that falls over comes to lie about an edge's length away
_MARGIN_M = 0.03  # between the wall that holds boxes back and the clearance that is checked
_BOX_FRICTION = [0.6, 0.005, 0.0001]
_TOUCHING_M = 0.002  # twice what settled boxes sink into each other


@dataclass(frozen=True, eq=False)
class Fall:
    """How boxes fall.

    Attributes:
        area_m: Extent along x and y over which they are dropped, centred on the origin [m].
        piles: Number of places around which they fall; 0 spreads them evenly.
        clearance_m: Least distance from the ground robot's path [m].
        top_m: Nothing may lie higher than this [m].
        tumble: (N,) for each box, 0 drops it upright and aligned with the room, 1 in any
            orientation.
    """

    area_m: tuple[float, float]
    piles: int
    clearance_m: float
    top_m: float
    tumble: NDArray[np.float64]

    @classmethod
    def of(cls, rubble: Rubble, count: int) -> Fall:
        """Of so many cardboard boxes."""
        tumble = np.full(count, rubble.tumble)
        return cls(rubble.area_m, rubble.piles, rubble.clearance_m, MAX_HEAP_HEIGHT_M, tumble)


class Heap:
    """The physics of a heap while it settles.

    Args:
        scene: Scene of the heap.
        fall: How its boxes fall.
        sizes: (N, 3) edges of the boxes that fall [m].
        rng: Source of the places of piles.
        fixed: Boxes that stay where they are.
    """

    def __init__(
        self,
        scene: Scene,
        fall: Fall,
        sizes: NDArray,
        rng: np.random.Generator,
        fixed: Sequence[Box] = (),
    ) -> None:
        self.fall = fall
        self.sizes = sizes
        self.lane = lane_points(scene)
        self.half_room = np.array(scene.room.size_m) / 2
        self.fixed_places = np.array([box.T_world_box.translation for box in fixed]).reshape(-1, 3)
        self.fixed_radii = _radii(np.array([box.size_m for box in fixed]).reshape(-1, 3))
        self.model = _settling_model(scene, fall.clearance_m, sizes, fixed)
        self.data = mujoco.MjData(self.model)
        self.walls = np.flatnonzero(self.model.geom_bodyid == 0)[1 + len(fixed) :]
        self.parked = np.zeros(len(sizes), bool)
        self.park(np.arange(len(sizes)))
        self.parked[:] = False
        self.piles = self._draw_piles(rng)

    def _qpos(self) -> NDArray:
        return self.data.qpos.reshape(-1, 7)

    def poses(self) -> list[SE3]:
        return [SE3.from_quaternion_xyzw(q[[4, 5, 6, 3]], q[:3]) for q in self._qpos()]

    def lay(self, poses: Sequence[SE3]) -> None:
        """Put every box where it lies."""
        for box, pose in enumerate(poses):
            turn = np.roll(pose.quaternion_xyzw(), 1)
            self._qpos()[box] = [*pose.translation, *turn]

    def touching(self) -> NDArray[np.bool_]:
        """(N, N) which boxes touch each other."""
        self._stand_walls(False)
        self.model.geom_margin[:] = _TOUCHING_M
        mujoco.mj_forward(self.model, self.data)
        touch = np.zeros((len(self.sizes), len(self.sizes)), bool)
        bodies = self.model.geom_bodyid[self.data.contact.geom] - 1
        for one, other in bodies[(bodies >= 0).all(1)]:
            touch[one, other] = touch[other, one] = True
        self.model.geom_margin[:] = 0
        return touch

    def remaining(self) -> NDArray:
        return np.flatnonzero(~self.parked)

    def park(self, boxes: NDArray) -> None:
        """Put boxes far away, where they touch nothing."""
        for box in boxes:
            pose = [_PARKED_M + 3 * box, 0, self.sizes[box, 2] / 2, 1, 0, 0, 0]
            self._qpos()[box] = pose
            self.data.qvel.reshape(-1, 6)[box] = 0
        self.parked[boxes] = True

    def throw(
        self,
        boxes: NDArray,
        rng: np.random.Generator,
        homes: Mapping[int, NDArray[np.float64]] | None = None,
    ) -> None:
        """Hang boxes above the heap, none touching another, and let go.

        Those with a home (2,) [m] fall near it, in any orientation.
        """
        homes = homes or {}
        radii = _radii(self.sizes)
        waiting = set(boxes.tolist())
        placed = [i for i in range(len(self.sizes)) if i not in waiting and not self.parked[i]]
        for box in boxes:
            home = homes.get(int(box))
            candidates = self._free_places(radii[box], rng, home)
            others = np.concatenate([self.fixed_places, self._qpos()[placed, :3]])
            reach = np.concatenate([self.fixed_radii, radii[placed]]) + radii[box]
            gap = np.linalg.norm(candidates[:, None] - others[None, :, :2], axis=2)
            rise = np.sqrt(np.maximum(reach**2 - gap**2, 0))
            top = np.where(gap < reach, others[:, 2] + rise, 0).max(1, initial=0.0)
            best = int(np.argmin(top))
            tumble = self.fall.tumble[box] if home is None else 1.0
            turn = Rotation.from_rotvec(tumble * _in_ball(rng) * np.pi)
            height = max(top[best] + 0.02, 1.1 * radii[box])
            x, y = candidates[best]
            self._qpos()[box] = [x, y, height, *np.roll(turn.as_quat(), 1)]
            self.data.qvel.reshape(-1, 6)[box] = 0
            placed.append(int(box))

    def _free_places(
        self, radius: float, rng: np.random.Generator, home: NDArray | None
    ) -> NDArray:
        """(K, 2) places in the area or near a home, off the lane."""
        half = np.array(self.fall.area_m) / 2
        places, choice = rng.uniform(-half, half, (40, 2)), 6
        if home is not None:
            places, choice = home + rng.normal(0, _HOME_SPREAD_M, (40, 2)), 2
        elif len(self.piles):
            chosen = self.piles[rng.integers(len(self.piles), size=40)]
            places = np.clip(chosen + rng.normal(0, _PILE_SPREAD_M, (40, 2)), -half, half)
            choice = 2  # fewer to choose the lowest from: they pile up
        away = self._from_lane(places)
        free = places[away > self.fall.clearance_m + 0.7 * radius][:choice]
        return free if len(free) else places[[np.argmax(away)]]

    def _from_lane(self, places: NDArray) -> NDArray:
        """(K,) distance of places (K, 2) to the lane [m]."""
        return np.linalg.norm(places[:, None] - self.lane[None, ::5], axis=2).min(1)

    def _draw_piles(self, rng: np.random.Generator) -> NDArray:
        """(piles, 2) places off the lane, as far apart as many tries bring them."""
        half = np.array(self.fall.area_m) / 2 - _PILE_SPREAD_M
        piles = np.empty((0, 2))
        for _ in range(self.fall.piles):
            places = rng.uniform(-half, half, (200, 2))
            apart = np.linalg.norm(places[:, None] - piles[None], axis=2).min(1, initial=1.5)
            piles = np.append(piles, places[[np.argmax(apart + self._from_lane(places))]], axis=0)
        return piles

    def drop(self, rng: np.random.Generator) -> None:
        """Let all boxes fall and settle. What then lies wrong is thrown again, `ROUNDS` times, and
        put away after that."""
        bad = np.arange(len(self.sizes))
        for _ in range(1 + ROUNDS):
            self.throw(bad, rng)
            self.settle(walled=True)
            self.settle(walled=False)
            bad = self.offenders()
            if not len(bad):
                break
        while len(bad):
            self.park(bad)
            self.settle(walled=False)
            bad = self.offenders()

    def settle(self, walled: bool) -> None:
        """Step until nothing moves, or for a few seconds."""
        self._stand_walls(walled)
        mujoco.mj_forward(self.model, self.data)
        steps = int(SETTLE_S / self.model.opt.timestep)
        for step in range(steps):
            mujoco.mj_step(self.model, self.data)
            if step % 50 == 49 and np.abs(self.data.qvel).max() < SETTLED_MPS:
                break

    def _stand_walls(self, standing: bool) -> None:
        self.model.geom_contype[self.walls] = int(standing)
        self.model.geom_conaffinity[self.walls] = int(standing)

    def offenders(self) -> NDArray:
        """Boxes in the lane, too high, or at the walls of the room."""
        bad = []
        for i, pose in enumerate(self.poses()):
            if self.parked[i]:
                continue
            corners = pose @ (BOX_CORNERS * self.sizes[i] / 2)
            outside = (np.abs(corners[:, :2]) > self.half_room - 0.05).any()
            too_high = corners[:, 2].max() > self.fall.top_m - 0.02
            sunk = corners[:, 2].min() < -0.01
            near = distance_to_footprint(self.lane, corners) < self.fall.clearance_m
            if outside or too_high or near or sunk:
                bad.append(i)
        return np.array(bad, int)


def _in_ball(rng: np.random.Generator) -> NDArray:
    """(3,) uniform in the unit ball."""
    direction = rng.standard_normal(3)
    return direction / np.linalg.norm(direction) * rng.random() ** (1 / 3)


def _radii(sizes: NDArray) -> NDArray[np.float64]:
    """(N,) radii of balls that boxes with edges (N, 3) hardly leave [m]."""
    return np.asarray(0.42 * np.linalg.norm(sizes, axis=1))


def _settling_model(
    scene: Scene, clearance_m: float, sizes: NDArray, fixed: Sequence[Box]
) -> mujoco.MjModel:
    """Floor first, fixed boxes, the walls around the lane, then one free body a box."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 0.004
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 5
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], friction=[0.6, 0, 0])
    for box in fixed:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=box.size_m / 2,
            pos=box.T_world_box.translation,
            quat=np.roll(box.T_world_box.quaternion_xyzw(), 1),
            friction=_BOX_FRICTION,
        )
    slippery = {"friction": [0.01, 0, 0], "priority": 1}
    keep = clearance_m + _MARGIN_M
    corners = np.array(scene.ground.waypoints)[:, :2]
    for x, y in corners:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[keep, 6, 0], pos=[x, y, 6], **slippery
        )
    for start, end in pairwise(corners):
        length, middle = np.linalg.norm(end - start), (start + end) / 2
        if length < 1e-6:
            continue
        angle = np.arctan2(end[1] - start[1], end[0] - start[0]) / 2
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[length / 2, keep, 6],
            pos=[*middle, 6],
            quat=[np.cos(angle), 0, 0, np.sin(angle)],
            **slippery,
        )
    for size in sizes:
        body = spec.worldbody.add_body()
        body.add_freejoint()
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=size / 2, density=80, friction=_BOX_FRICTION
        )
    return spec.compile()
