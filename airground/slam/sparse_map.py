"""The sparse map: keyframes, points, and which keyframe saw which point where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from airground.core.arrays import F64, I64, U8, Floats, Mask
from airground.core.se3 import SE3
from airground.slam.inertial.alignment import InertialAlignment
from airground.slam.inertial.stationarity import Rest
from airground.slam.rig_state import RigState
from airground.slam.rolling_shutter import GLOBAL, Shutter

FIRST_POINTS = 4096
DEPTH_RANGE_PERCENT = 2.0
"""This share of the points at either end is left out of a depth range: some are wrong."""
CANDIDATE, MAPPED, DROPPED = 0, 1, 2
"""State of a point: seen but without a position yet, in the map, found to be wrong."""


@dataclass(eq=False)
class Keyframe:
    """One image that stays, its state, and what it saw.

    Attributes:
        image: (height, width) uint8 grey image.
        ids: (n,) int64 numbers of the points seen, each once.
        pixels: (n, 2) float64 pixels of the points, straight (`rolling_shutter`).
        inverse_depths: (n,) measured inverse depths [1/m]; NaN without one.
        still: Whether the robot was at rest.
        held: Whether a neighbour was culled with its inertial motion. The poses then contain its
            information on scale and vertical, which adjusting the whole map must not lose.
        shutter: How the camera turned while the rows were taken.
    """

    stamp_ns: int
    image: U8
    state: RigState
    ids: I64
    pixels: F64
    inverse_depths: F64
    still: bool = False
    held: bool = False
    shutter: Shutter = GLOBAL

    def see(self, ids: I64, pixels: F64, inverse_depths: F64) -> None:
        """Add observations of points that this keyframe does not have yet."""
        self.ids = np.concatenate([self.ids, ids])
        self.pixels = np.concatenate([self.pixels, pixels])
        self.inverse_depths = np.concatenate([self.inverse_depths, inverse_depths])

    def in_image(self) -> F64:
        """(n, 2) where the points are in the image."""
        return self.shutter.in_image(self.pixels)

    def forget(self, wrong: Mask) -> None:
        """Drop observations, (n,) marked."""
        self.ids = self.ids[~wrong]
        self.pixels = self.pixels[~wrong]
        self.inverse_depths = self.inverse_depths[~wrong]


def camera_poses(keyframes: Sequence[Keyframe], T_rig_camera: SE3) -> tuple[F64, F64]:
    """(n, 3, 3) and (n, 3) `T_map_camera` of keyframes."""
    rotations = np.array([keyframe.state.rotation for keyframe in keyframes])
    positions = np.array([keyframe.state.position for keyframe in keyframes])
    return rotations @ T_rig_camera.rotation, rotations @ T_rig_camera.translation + positions


class PointHolder(Protocol):
    """What holds numbers of points besides keyframes."""

    def held_points(self) -> I64:
        """(n,) numbers of points, in any order."""

    def renumber(self, new: I64) -> None:
        """Points have other numbers: by the old one, `new` has that of each point held."""


class SparseMap:
    """Keyframes in order of time, and points by their number.

    Attributes:
        holders: What else holds numbers of points.
        renumbers: Whether points may have other numbers: no work under way holds any.
        keyframes: Keyframes that were not culled.
        culled: Number of culled keyframes.
        positions: (capacity, 3) positions of the points [m]; only those MAPPED count.
        states: (capacity,) state of each point: CANDIDATE, MAPPED or DROPPED.
        origins: (capacity,) index of the keyframe that first saw each point.
        first_pixels: (capacity, 2) pixel of each point in that keyframe.
    """

    def __init__(self) -> None:
        self.keyframes: list[Keyframe] = []
        self.holders: list[PointHolder] = []
        self.renumbers = True
        self.culled = 0
        self.positions = np.zeros((FIRST_POINTS, 3))
        self.states = np.zeros(FIRST_POINTS, np.int8)
        self.origins = np.zeros(FIRST_POINTS, np.int64)
        self.first_pixels = np.zeros((FIRST_POINTS, 2))
        self._count = 0
        self._compact_at = FIRST_POINTS

    def __len__(self) -> int:
        """Points that have a number."""
        return self._count

    @property
    def made(self) -> int:
        """Keyframes that were ever made."""
        return len(self.keyframes) + self.culled

    def new_points(self, pixels: Floats, origin: int) -> I64:
        """Numbers of new candidates, first seen at (n, 2) pixels of keyframe `origin`."""
        count = len(pixels)
        while self._count + count > len(self.states):
            for name in ("positions", "states", "origins", "first_pixels"):
                array = getattr(self, name)
                setattr(self, name, np.concatenate([array, np.zeros_like(array)]))
        ids = np.arange(self._count, self._count + count)
        self.origins[ids] = origin
        self.first_pixels[ids] = pixels
        self._count += count
        return ids

    def place(self, ids: I64, positions: F64) -> None:
        """Give candidates a position; from now on they are in the map."""
        self.positions[ids] = positions
        self.states[ids] = MAPPED

    def mapped(self, ids: I64) -> Mask:
        """(n,) whether the points are in the map."""
        result: Mask = self.states[ids] == MAPPED
        return result

    def in_map(self) -> I64:
        """Numbers of all points in the map."""
        return np.flatnonzero(self.states[: self._count] == MAPPED)

    def drop(self, ids: I64) -> None:
        """Take points out for good."""
        self.states[ids] = DROPPED

    def cull(self, keyframe: int) -> None:
        """Take a keyframe out, not the first; a point that fewer than two others saw goes with it.
        Candidates first seen in it begin in the next keyframe that saw them."""
        gone = self.keyframes.pop(keyframe)
        self.culled += 1
        # What was first seen in the culled keyframe counts as old as the one before it.
        origins = self.origins[: self._count]
        begun_here = gone.ids[(self.origins[gone.ids] == keyframe)]
        origins[origins >= keyframe] -= 1
        views = np.zeros(len(self.states), np.int64)
        waiting = begun_here[self.states[begun_here] == CANDIDATE]
        for index, other in enumerate(self.keyframes):
            views[other.ids] += 1
            if index >= keyframe and len(waiting):
                again, _, rows = np.intersect1d(waiting, other.ids, return_indices=True)
                self.origins[again], self.first_pixels[again] = index, other.pixels[rows]
                waiting = np.setdiff1d(waiting, again)
        self.drop(waiting)
        mapped = gone.ids[self.mapped(gone.ids)]
        self.drop(mapped[views[mapped] < 2])

    def compact(self) -> None:
        """Renumber the points, in the same order, without those that nothing holds any more.

        Does so once points have doubled in number: most are dropped or go with their keyframes,
        so that in a bounded area the memory stays bounded. What follows does not change by it.
        """
        if not self.renumbers or self._count < self._compact_at:
            return
        seen = [keyframe.ids for keyframe in self.keyframes]
        held = np.unique(np.concatenate([*seen, *(one.held_points() for one in self.holders)]))
        new = np.full(self._count, -1)
        new[held] = np.arange(len(held))
        for name in ("positions", "states", "origins", "first_pixels"):
            array = getattr(self, name)
            array[: len(held)] = array[held]
            array[len(held) :] = 0
        for keyframe in self.keyframes:
            keyframe.ids = new[keyframe.ids]
        for holder in self.holders:
            holder.renumber(new)
        self._count = len(held)
        self._compact_at = max(FIRST_POINTS, 2 * self._count)

    def seen_by(self, keyframes: list[int]) -> I64:
        """Numbers of all points in the map that one of the keyframes saw, sorted."""
        if not keyframes:
            return np.empty(0, np.int64)
        ids = np.unique(np.concatenate([self.keyframes[k].ids for k in keyframes]))
        return ids[self.mapped(ids)]

    def begun_before(self, keyframe: int) -> I64:
        """Numbers of all points in the map that were first seen earlier than a keyframe."""
        n = self._count
        return np.flatnonzero((self.states[:n] == MAPPED) & (self.origins[:n] < keyframe))

    def shared(self, ids: I64) -> I64:
        """(K,) how many of the points each keyframe saw."""
        wanted = np.zeros(len(self.states), bool)
        wanted[ids] = True
        return np.array([int(wanted[keyframe.ids].sum()) for keyframe in self.keyframes])

    def depth_range(self, ids: I64, T_map_camera: SE3, least: int) -> tuple[float, float] | None:
        """Nearest and farthest of the points in a view, along its optical axis [m].

        Args:
            ids: Numbers of the points seen; only those in the map count.
            T_map_camera: Pose of the view.
            least: Least number of points for a range.
        """
        ids = ids[self.mapped(ids)]
        if len(ids) < least:
            return None
        z = (T_map_camera.inverse() @ self.positions[ids])[:, 2]
        low, high = np.percentile(z, [DEPTH_RANGE_PERCENT, 100 - DEPTH_RANGE_PERCENT])
        return (float(low), float(high)) if low > 0 else None

    def set_motion(self, alignment: InertialAlignment) -> None:
        """Give the newest keyframes the velocities and biases that were found for them."""
        newest = self.keyframes[-len(alignment.velocities) :]
        for n, keyframe in enumerate(newest):
            keyframe.state = replace(
                keyframe.state,
                velocity=alignment.velocities[n],
                gyro_bias=alignment.gyro_biases[n],
                accelerometer_bias=alignment.accelerometer_biases[n],
            )

    def stand_still(self, since_ns: int, rest: Rest) -> None:
        """Keyframes from `since_ns` on are at rest; the biases seen there are those of all."""
        for keyframe in self.keyframes:
            keyframe.still |= keyframe.stamp_ns >= since_ns
            standing = keyframe.state.standing(rest)
            moving = replace(standing, velocity=keyframe.state.velocity)
            keyframe.state = standing if keyframe.still else moving

    def shift(self, by: F64) -> None:
        """Move the whole map by (3,) [m]."""
        for keyframe in self.keyframes:
            keyframe.state = keyframe.state.shifted(by)
        self.positions[: self._count] += by

    def move(self, scale: float, rotation: F64, lever: F64) -> None:
        """Scale and turn the whole map about its origin, as `RigState.scaled` does a state."""
        for keyframe in self.keyframes:
            keyframe.state = keyframe.state.scaled(scale, rotation, lever)
        n = self._count
        self.positions[:n] = scale * self.positions[:n] @ rotation.T
