"""Heaps of cardboard boxes: drawn, dropped, settled by physics, then frozen where they lie."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.core.arrays import read_only
from airground.core.se3 import SE3
from airground.errors import InputError
from sim.geometry.surface import BOX_CORNERS
from sim.scene import MAX_HEAP_HEIGHT_M, Rubble, Scene

ROUNDS = 6
SETTLE_S = 4.0
SETTLED_MPS = 0.02
_PARKED_M = 200.0
_PILE_SPREAD_M = 0.35
_MARGIN_M = 0.03  # between the wall that holds boxes back and the clearance that is checked


@dataclass(frozen=True, eq=False)
class Box:
    """A settled box.

    Attributes:
        name: Unique, `box_000` and so on.
        make: Index of its make; boxes of a make share size, board and print.
        size_m: (3,) full edge lengths along its own axes [m]; z is up when it stands.
        T_world_box: Pose of its centre.
    """

    name: str
    make: int
    size_m: NDArray[np.float64]
    T_world_box: SE3

    def __post_init__(self) -> None:
        object.__setattr__(self, "size_m", read_only(self.size_m, "size_m", (3,), np.float64))

    def corners(self) -> NDArray[np.float64]:
        """(8, 3) corners in `world` [m]."""
        return self.T_world_box @ (BOX_CORNERS * self.size_m / 2)


def make_heap(scene: Scene, rng: np.random.Generator) -> tuple[Box, ...]:
    """Drop the boxes of `scene` and return them as they came to rest.

    Boxes fall while a wall keeps the ground robot's lane free; then the wall goes, and what
    falls into the lane or lies too high is thrown again. The same generator state gives the
    same heap.

    Raises:
        InputError: So few boxes fit beside the lane that less than nine tenths remain.
    """
    rubble = scene.rubble
    if rubble is None:
        return ()
    makes, sizes = _draw_boxes(rubble, rng)
    heap = _Heap(scene, sizes, rng)
    bad = np.arange(len(sizes))
    for _ in range(1 + ROUNDS):
        heap.throw(bad, rng)
        heap.settle(walled=True)
        heap.settle(walled=False)
        bad = heap.offenders()
        if not len(bad):
            break
    while len(bad):
        heap.park(bad)
        heap.settle(walled=False)
        bad = heap.offenders()
    kept = heap.remaining()
    if len(kept) < 0.9 * rubble.boxes:
        raise InputError(
            f"scene '{scene.name}': only {len(kept)} of rubble.boxes = {rubble.boxes} fit into "
            f"rubble.area_m = {list(rubble.area_m)} beside the ground robot's lane"
        )
    poses = heap.poses()
    return tuple(Box(f"box_{k:03d}", int(makes[i]), sizes[i], poses[i]) for k, i in enumerate(kept))


def lane_points(scene: Scene, step_m: float = 0.03) -> NDArray[np.float64]:
    """(N, 2) points along the ground robot's waypoints, `step_m` apart [m]."""
    corners = np.array(scene.ground.waypoints)[:, :2]
    pieces = [corners[:1]]
    for start, end in pairwise(corners):
        count = int(np.ceil(np.linalg.norm(end - start) / step_m))
        if count:
            pieces.append(start + (end - start) * np.linspace(0, 1, count + 1)[1:, None])
    return np.concatenate(pieces)


def distance_to_footprint(points: NDArray, corners: NDArray) -> float:
    """Smallest horizontal distance [m] of points (N, 2) to a convex body; 0 inside.

    The hull of its `corners` (C, 3) [m] seen from above is its footprint.
    """
    hull = cv2.convexHull(corners[:, :2].astype(np.float32))[:, 0].astype(np.float64)
    edges = np.roll(hull, -1, axis=0) - hull
    offsets = points[:, None] - hull[None]
    along = np.einsum("nek,ek->ne", offsets, edges) / np.maximum((edges**2).sum(1), 1e-12)
    nearest = hull + np.clip(along, 0, 1)[..., None] * edges
    distance = np.linalg.norm(points[:, None] - nearest, axis=2).min(1)
    side = edges[:, 0] * offsets[..., 1] - edges[:, 1] * offsets[..., 0]
    inside = (side >= 0).all(1) | (side <= 0).all(1)
    return float(np.where(inside, 0.0, distance).min())


def _draw_boxes(rubble: Rubble, rng: np.random.Generator) -> tuple[NDArray, NDArray]:
    """Make (N,) and size (N, 3) [m] of every box."""
    low, high = rubble.edge_m
    # Small edges are more common than large ones, as in a real delivery.
    edges = low + (high - low) * rng.beta(1.3, 1.7, (rubble.makes, 3))
    edges.sort(axis=1)
    edges = edges[:, [2, 1, 0]]  # longest first: a box stands on its largest face
    makes = rng.integers(0, rubble.makes, rubble.boxes)
    makes[rng.random(rubble.boxes) < rubble.self_similarity] = 0
    return makes, np.round(rubble.size_scale * edges[makes], 3)


class _Heap:
    """The physics of a heap while it settles."""

    def __init__(self, scene: Scene, sizes: NDArray, rng: np.random.Generator) -> None:
        assert scene.rubble is not None
        self.rubble = scene.rubble
        self.sizes = sizes
        self.lane = lane_points(scene)
        self.half_room = np.array(scene.room.size_m) / 2
        self.model = _settling_model(scene, sizes)
        self.data = mujoco.MjData(self.model)
        self.walls = np.flatnonzero(self.model.geom_bodyid == 0)[1:]
        self.parked = np.zeros(len(sizes), bool)
        self.park(np.arange(len(sizes)))
        self.parked[:] = False
        self.piles = self._draw_piles(rng)

    def _qpos(self) -> NDArray:
        return self.data.qpos.reshape(-1, 7)

    def poses(self) -> list[SE3]:
        return [SE3.from_quaternion_xyzw(q[[4, 5, 6, 3]], q[:3]) for q in self._qpos()]

    def remaining(self) -> NDArray:
        return np.flatnonzero(~self.parked)

    def park(self, boxes: NDArray) -> None:
        """Put boxes far away, where they touch nothing."""
        for box in boxes:
            pose = [_PARKED_M + 3 * box, 0, self.sizes[box, 2] / 2, 1, 0, 0, 0]
            self._qpos()[box] = pose
            self.data.qvel.reshape(-1, 6)[box] = 0
        self.parked[boxes] = True

    def throw(self, boxes: NDArray, rng: np.random.Generator) -> None:
        """Hang boxes above the heap, none touching another, and let go."""
        radii = 0.42 * np.linalg.norm(self.sizes, axis=1)
        waiting = set(boxes.tolist())
        placed = [i for i in range(len(self.sizes)) if i not in waiting and not self.parked[i]]
        for box in boxes:
            candidates = self._free_places(radii[box], rng)
            others = self._qpos()[placed, :3]
            reach = radii[placed] + radii[box]
            gap = np.linalg.norm(candidates[:, None] - others[None, :, :2], axis=2)
            rise = np.sqrt(np.maximum(reach**2 - gap**2, 0))
            top = np.where(gap < reach, others[:, 2] + rise, 0).max(1, initial=0.0)
            best = int(np.argmin(top))
            turn = Rotation.from_rotvec(self.rubble.tumble * _in_ball(rng) * np.pi)
            height = max(top[best] + 0.02, 1.1 * radii[box])
            x, y = candidates[best]
            self._qpos()[box] = [x, y, height, *np.roll(turn.as_quat(), 1)]
            self.data.qvel.reshape(-1, 6)[box] = 0
            placed.append(int(box))

    def _free_places(self, radius: float, rng: np.random.Generator) -> NDArray:
        """(K, 2) places in the area, off the lane."""
        half = np.array(self.rubble.area_m) / 2
        places, choice = rng.uniform(-half, half, (40, 2)), 6
        if len(self.piles):
            chosen = self.piles[rng.integers(len(self.piles), size=40)]
            places = np.clip(chosen + rng.normal(0, _PILE_SPREAD_M, (40, 2)), -half, half)
            choice = 2  # fewer to choose the lowest from: they pile up
        away = self._from_lane(places)
        free = places[away > self.rubble.clearance_m + 0.7 * radius][:choice]
        return free if len(free) else places[[np.argmax(away)]]

    def _from_lane(self, places: NDArray) -> NDArray:
        """(K,) distance of places (K, 2) to the lane [m]."""
        return np.linalg.norm(places[:, None] - self.lane[None, ::5], axis=2).min(1)

    def _draw_piles(self, rng: np.random.Generator) -> NDArray:
        """(piles, 2) places off the lane, as far apart as many tries bring them."""
        half = np.array(self.rubble.area_m) / 2 - _PILE_SPREAD_M
        piles = np.empty((0, 2))
        for _ in range(self.rubble.piles):
            places = rng.uniform(-half, half, (200, 2))
            apart = np.linalg.norm(places[:, None] - piles[None], axis=2).min(1, initial=1.5)
            piles = np.append(piles, places[[np.argmax(apart + self._from_lane(places))]], axis=0)
        return piles

    def settle(self, walled: bool) -> None:
        """Step until nothing moves, or for a few seconds."""
        self.model.geom_contype[self.walls] = int(walled)
        self.model.geom_conaffinity[self.walls] = int(walled)
        mujoco.mj_forward(self.model, self.data)
        steps = int(SETTLE_S / self.model.opt.timestep)
        for step in range(steps):
            mujoco.mj_step(self.model, self.data)
            if step % 50 == 49 and np.abs(self.data.qvel).max() < SETTLED_MPS:
                break

    def offenders(self) -> NDArray:
        """Boxes in the lane, too high, or at the walls of the room."""
        bad = []
        for i, pose in enumerate(self.poses()):
            if self.parked[i]:
                continue
            corners = pose @ (BOX_CORNERS * self.sizes[i] / 2)
            outside = (np.abs(corners[:, :2]) > self.half_room - 0.05).any()
            too_high = corners[:, 2].max() > MAX_HEAP_HEIGHT_M - 0.02
            sunk = corners[:, 2].min() < -0.01
            near = distance_to_footprint(self.lane, corners) < self.rubble.clearance_m
            if outside or too_high or near or sunk:
                bad.append(i)
        return np.array(bad, int)


def _in_ball(rng: np.random.Generator) -> NDArray:
    """(3,) uniform in the unit ball."""
    direction = rng.standard_normal(3)
    return direction / np.linalg.norm(direction) * rng.random() ** (1 / 3)


def _settling_model(scene: Scene, sizes: NDArray) -> mujoco.MjModel:
    """Floor first, then the walls around the lane, then one free body a box."""
    assert scene.rubble is not None
    spec = mujoco.MjSpec()
    spec.option.timestep = 0.004
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 5
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], friction=[0.6, 0, 0])
    slippery = {"friction": [0.01, 0, 0], "priority": 1}
    keep = scene.rubble.clearance_m + _MARGIN_M
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
            type=mujoco.mjtGeom.mjGEOM_BOX, size=size / 2, density=80, friction=[0.6, 0.005, 0.0001]
        )
    return spec.compile()
