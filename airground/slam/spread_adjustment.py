"""Adjusting the whole map without waiting for it: a large one in pieces, one at each image.

Meanwhile the map goes on growing. So what adjustment found for a keyframe or a point moves it from
where it has got to, and all that came later follows the newest keyframe that took part.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from airground.core.arrays import F64
from airground.slam.bundle_adjustment import Adjustment, Pieces, States, adjusting
from airground.slam.loop_closure import LoopCloser
from airground.slam.map_adjustment import GLOBAL, MOST_AT_ONCE, MapAdjuster
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import SparseMap


@dataclass(eq=False)
class WholeMap:
    """When the whole map is adjusted: at once, or spread over the images that follow.

    Spread, a first image takes the map as it is, every further one does a piece of the work (some
    four of them make a step of the optimization), and the last one moves the map. Pieces are
    counted, not timed, so that the result depends on the images only. Looking for a closed loop
    goes first, a piece an image, too. A closed loop and `at_once` adjust the same map: work under
    way is then dropped. Where the map is scaled or turned, it begins anew; with another map
    (`KeyframeSlam.reset`) it is gone.
    """

    map: SparseMap
    adjuster: MapAdjuster
    loops: LoopCloser
    _due: bool = field(default=False, init=False)
    _work: SpreadAdjustment | None = field(default=None, init=False)

    def at_once(self, inertial: bool) -> bool:
        """Adjust the whole map; returns True: it was adjusted."""
        self.drop()
        self.adjuster.adjust_all(inertial)
        return True

    def begin(self, inertial: bool) -> bool:
        """Adjust a small map at once, and a large one from the next image on, unless that is under
        way; returns whether it was adjusted. Only for maps whose scale and vertical are known: the
        correction of others is large, and cannot wait."""
        self._due = len(self.map.keyframes) > MOST_AT_ONCE
        return not self._due and self.at_once(inertial)

    def go_on(self, inertial: bool) -> bool:
        """Do a piece of work if there is any; returns whether the map was adjusted."""
        if self.loops.under_way:
            closed = self.loops.go_on()
            if closed:
                self._loop_closed()
            return closed
        if not self._due:
            return False
        if self._work is None:
            self._work = SpreadAdjustment(self.map, self.adjuster, inertial)
            self.map.renumbers = False
        elif self._work.go_on():
            self.drop()
            return True
        return False

    def drop(self) -> None:
        """The whole map was adjusted otherwise: nothing is to be done."""
        self._due = False
        self._forget()

    def begin_anew(self) -> None:
        """The map was scaled or turned: work under way is of no use."""
        self._forget()
        self.loops.drop()

    def _forget(self) -> None:
        self._work = None
        self.map.renumbers = True

    def _loop_closed(self) -> None:
        """The adjustment of a large map goes on from the next image on."""
        self.drop()
        self._due = len(self.map.keyframes) > MOST_AT_ONCE


class SpreadAdjustment:
    """One adjustment of the whole map as it is, in pieces."""

    def __init__(self, sparse_map: SparseMap, adjuster: MapAdjuster, inertial: bool) -> None:
        self._map, self._adjuster, self._inertial = sparse_map, adjuster, inertial
        self._problem = adjuster.whole_map(inertial)
        settings = adjuster.with_prior(GLOBAL)
        self._pieces: Pieces[Adjustment] = adjusting(
            *self._problem.parts(), adjuster.camera, adjuster.T_rig_camera, settings
        )

    def go_on(self) -> bool:
        """Do one piece; returns whether it was the last, which moves the map."""
        try:
            next(self._pieces)
        except StopIteration as finished:
            self._move_map(finished.value)
            return True
        return False

    def _move_map(self, result: Adjustment) -> None:
        problem, sparse_map, adjuster = self._problem, self._map, self._adjuster
        place = adjuster.place_that_stays(problem)
        lever = adjuster.T_rig_camera.translation
        changes = _changes(problem.states, result.states, self._inertial)
        taking_part = dict(zip(map(id, problem.keyframes), changes, strict=True))
        later = replace(changes[-1], faster=np.zeros(3), scale=self._scale(result))
        now = [taking_part.get(id(keyframe), later) for keyframe in sparse_map.keyframes]
        for keyframe, change in zip(sparse_map.keyframes, now, strict=True):
            keyframe.state = change.of_state(keyframe.state, lever)
        positions = sparse_map.positions
        # A point that did not take part goes with the keyframe that saw it first.
        others = np.setdiff1d(sparse_map.in_map(), problem.points)
        origins = sparse_map.origins[others]
        for k in np.unique(origins):
            ids = others[origins == k]
            positions[ids] = now[k].of_points(positions[ids])
        positions[problem.points] += result.points - problem.positions
        adjuster.keep_place(problem, place)
        sigma_px = adjuster.parameters.corner_sigma_px
        problem.drop_misfits(sparse_map, result.residuals_px, sigma_px)
        adjuster.settle(problem.keyframes[-1])

    def _scale(self, result: Adjustment) -> float:
        """By what factor the depth of the newest view changed: without depth camera and IMU the
        scale is open."""
        problem = self._problem
        rows = np.searchsorted(problem.points, problem.sightings[-1])
        if len(rows) < self._adjuster.parameters.min_points:
            return 1.0
        before = self._depths(problem.states, problem.positions[rows])
        return float(np.median(self._depths(result.states, result.points[rows]) / before))

    def _depths(self, states: States, points: F64) -> F64:
        """(n,) depth of points in the newest keyframe [m]."""
        ahead = states.rotations[-1] @ self._adjuster.T_rig_camera.rotation[:, 2]
        centre = states.rotations[-1] @ self._adjuster.T_rig_camera.translation
        depths: F64 = (points - states.positions[-1] - centre) @ ahead
        return depths


@dataclass(frozen=True, eq=False)
class Change:
    """What adjustment did to a keyframe, to be done to all that hangs on it.

    Attributes:
        turn: (3, 3) rotation of the map about the keyframe.
        before, after: (3,) position of its rig [m].
        faster: (3,) change of its velocity, beyond the turn [m/s].
        gyro, accelerometer: (3,) changes of the biases [rad/s], [m/s^2].
        scale: Factor on distances from the keyframe.
    """

    turn: F64
    before: F64
    after: F64
    faster: F64
    gyro: F64
    accelerometer: F64
    scale: float = 1.0

    def of_state(self, state: RigState, lever: F64) -> RigState:
        """The state after the change; `lever` is the (3,) position of the camera in the rig [m]."""
        moved = state.shifted(-self.before).scaled(self.scale, self.turn, lever)
        return replace(
            moved.shifted(self.after),
            velocity=moved.velocity + self.faster,
            gyro_bias=state.gyro_bias + self.gyro,
            accelerometer_bias=state.accelerometer_bias + self.accelerometer,
        )

    def of_points(self, points: F64) -> F64:
        """(n, 3) points after the change [m]."""
        return self.after + self.scale * (points - self.before) @ self.turn.T


def _changes(before: States, after: States, inertial: bool) -> list[Change]:
    """What became of each keyframe; without inertia velocity and accelerometer do not count."""
    turns = after.rotations @ before.rotations.transpose(0, 2, 1)
    faster = after.velocities - np.einsum("nij,nj->ni", turns, before.velocities)
    pushed = after.accelerometer_biases - before.accelerometer_biases
    parts = (
        turns,
        before.positions,
        after.positions,
        inertial * faster,
        after.gyro_biases - before.gyro_biases,
        inertial * pushed,
    )
    return [Change(*one) for one in zip(*parts, strict=True)]
