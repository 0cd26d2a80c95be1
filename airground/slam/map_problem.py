"""A part of the sparse map, laid out for bundle adjustment."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from airground.config import KeyframeSlam
from airground.core.arrays import F64, I64
from airground.slam.bundle_adjustment import InertialFactor, Observations, States
from airground.slam.inertial.preintegration import Preintegration
from airground.slam.sparse_map import Keyframe, SparseMap

MAX_RESIDUAL_SIGMAS = 3.5
"""An observation farther off than this was of something else."""
Parts: TypeAlias = tuple[States, I64, F64, Observations, list[InertialFactor]]


@dataclass(frozen=True, eq=False)
class MapProblem:
    """What adjustment reads of a map: what the map changes later does not reach it.

    Attributes:
        keyframes: K keyframes that take part, in order of time.
        states: Their states.
        roles: (K,) `Role` of each.
        seen: Numbers of all points that moving keyframes saw.
        points: (P,) numbers of those that take part: at least two of the keyframes saw them.
        positions: (P, 3) their positions [m].
        sightings: For each keyframe, (n,) numbers of those points that it saw.
        observations: All sightings, keyframe by keyframe.
        factors: Inertial motions between neighbours.
    """

    keyframes: list[Keyframe]
    states: States
    roles: I64
    seen: I64
    points: I64
    positions: F64
    sightings: list[I64]
    observations: Observations
    factors: list[InertialFactor]

    @classmethod
    def of(
        cls,
        sparse_map: SparseMap,
        chosen: list[int],
        roles: I64,
        seen: I64,
        motions: Mapping[int, Preintegration],
        parameters: KeyframeSlam,
        inverse_depth_sigma: float,
    ) -> MapProblem:
        """Read the map.

        Args:
            chosen: Keyframes that take part, in order of time.
            roles: (K,) `Role` of each.
            seen: Numbers of all points that moving keyframes saw.
            motions: Inertial motion before each keyframe, by its index.
            inverse_depth_sigma: Standard deviation of measured inverse depth [1/m].
        """
        keyframes = [sparse_map.keyframes[k] for k in chosen]
        # Seen once in here, a point would go along with that view and say nothing.
        points = seen[views(sparse_map, keyframes)[seen] >= 2]
        row_of = np.full(len(sparse_map), -1)
        row_of[points] = np.arange(len(points))
        rows = [np.flatnonzero(row_of[keyframe.ids] >= 0) for keyframe in keyframes]
        pairs = list(zip(keyframes, rows, strict=True))
        sightings = [keyframe.ids[r] for keyframe, r in pairs]
        inverse_depths = np.concatenate([keyframe.inverse_depths[r] for keyframe, r in pairs])
        observations = Observations(
            keyframes=np.repeat(np.arange(len(chosen)), [len(r) for r in rows]),
            points=np.concatenate([row_of[ids] for ids in sightings]),
            pixels=np.concatenate([keyframe.pixels[r] for keyframe, r in pairs]),
            sigmas_px=np.full(len(inverse_depths), parameters.corner_sigma_px),
            inverse_depths=inverse_depths,
            inverse_depth_sigmas=np.full(len(inverse_depths), inverse_depth_sigma),
        )
        place = {k: n for n, k in enumerate(chosen)}
        factors = [
            InertialFactor(place[k - 1], place[k], motion)
            for k, motion in sorted(motions.items())
            if k in place and k - 1 in place
        ]
        return cls(
            keyframes,
            _states(keyframes),
            roles,
            seen,
            points,
            sparse_map.positions[points],
            sightings,
            observations,
            factors,
        )

    def parts(self) -> Parts:
        """The first arguments of `adjust`."""
        return self.states, self.roles, self.positions, self.observations, self.factors

    def drop_misfits(self, sparse_map: SparseMap, residuals_px: F64, sigma_px: float) -> None:
        """Drop observations that do not fit, and then points that fewer than two keyframes saw.

        Args:
            residuals_px: (M,) distance of each observation from where it should have been [px].
            sigma_px: Standard deviation of a corner's coordinates [px].
        """
        # Written so that NaN, a point behind the camera, counts as wrong.
        wrong = ~(residuals_px < MAX_RESIDUAL_SIGMAS * sigma_px)
        bounds = np.cumsum([len(ids) for ids in self.sightings])[:-1]
        parts = zip(self.keyframes, self.sightings, np.split(wrong, bounds), strict=True)
        for keyframe, ids, bad in parts:
            keyframe.forget(np.isin(keyframe.ids, ids[bad]))
        everywhere = views(sparse_map, sparse_map.keyframes)
        sparse_map.drop(self.seen[everywhere[self.seen] < 2])


def views(sparse_map: SparseMap, keyframes: Iterable[Keyframe]) -> I64:
    """(P,) how many of the keyframes saw each point."""
    counts = np.zeros(len(sparse_map), np.int64)
    for keyframe in keyframes:
        counts[keyframe.ids] += 1
    return counts


def _states(keyframes: list[Keyframe]) -> States:
    states = [keyframe.state for keyframe in keyframes]
    return States(
        rotations=np.array([s.rotation for s in states]),
        positions=np.array([s.position for s in states]),
        velocities=np.array([s.velocity for s in states]),
        gyro_biases=np.array([s.gyro_bias for s in states]),
        accelerometer_biases=np.array([s.accelerometer_bias for s in states]),
        still=np.array([keyframe.still for keyframe in keyframes]),
    )
