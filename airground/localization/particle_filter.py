"""Monte Carlo localization of the MAV in the ground robot's map (Sec. VI-B)."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from airground.config import Config
from airground.core.agreement import agreement
from airground.core.arrays import F64, Floats
from airground.core.belief import Belief
from airground.core.events import BeliefUpdated, CostMapComputed, Event, HeightMapsMade
from airground.core.height_map import make_height_map
from airground.core.se3 import SE3
from airground.localization.claim import Fit, why_refused
from airground.localization.cost_map import Overlays
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.hypotheses import CostVolume
from airground.localization.particles import densest_mode, mean_pose, resample, span, weights
from airground.localization.self_similarity import why_ambiguous


class MonteCarloLocalizer:
    """A belief over u, the position (and heading) of the MAV's camera in `ground`.

    Attributes:
        config: The pipeline's parameters; height maps and localization are used.
        belief: Belief after the newest aerial surface, None before the first.
    """

    def __init__(self, config: Config, rng: np.random.Generator) -> None:
        self.config = config
        self._local = config.localization
        self._rng = rng
        self._particles: F64 | None = None
        self._position_mav = np.zeros(3)
        self._newest: deque[HeightMapPair] = deque(maxlen=self._local.joint_maps)
        self.belief: Belief | None = None

    def update(self, pair: HeightMapPair) -> Iterator[Event]:
        """Take in one aerial surface and the ground map, under this filter's parameters.

        Yields:
            HeightMapsMade, CostMapComputed (where all of it is computed), BeliefUpdated.

        Raises:
            InputError: The heading is needed and unknown, or the resolutions differ.
        """
        self._newest.append(pair)
        surfaces = tuple(self._newest)
        together = pair.joined(surfaces[:-1])
        pair = pair.joined(surfaces[-self._local.maps_together : -1])
        position_mav = np.array(pair.position_mav, np.float64)
        yield HeightMapsMade(pair.stamp_ns, pair.aerial, pair.ground)

        # Costs of all hypotheses: for the first particles, and for those drawn anew.
        volume = None
        if self._particles is None or self._local.redrawn_fraction > 0:
            volume = pair.volume
            yield CostMapComputed(pair.stamp_ns, volume.cost_map(self._local.cost))

        if self._particles is None:
            assert volume is not None
            sigma = self._sigma_of(volume.costs)
            particles = volume.draw(self._local.particles, sigma, self._rng)
        else:
            moved = self._move(self._particles, position_mav - self._position_mav, pair)
            moved = self._redraw(moved, volume)
            costs = pair.costs(moved)
            particles = moved[resample(weights(costs, self._sigma_of(costs)), self._rng)]

        self.belief = self._summarize(pair, together, particles)
        if volume is None or volume.feasible or self._particles is not None:
            # Else nothing overlapped yet, and the next surface is the first one again.
            self._particles = particles
        self._position_mav = position_mav
        yield BeliefUpdated(pair.stamp_ns, self.belief)

    def _sigma_of(self, costs: Floats) -> float:
        """Sigma of Eq. 5 in units of the costs that it is used on."""
        scale = span(costs) if self._local.sigma_units == "minmax" else 1.0
        return self._local.sigma * scale

    def _move(self, particles: F64, motion_mav: F64, pair: HeightMapPair) -> F64:
        """Eq. 6: the motion that the MAV's SLAM saw, turned into `ground`, plus noise."""
        m = len(particles)
        moved = particles.copy()
        if pair.searched:
            moved[:, 2] += np.deg2rad(self._local.heading_noise_deg) * self._rng.normal(size=m)
        else:
            moved[:, 2] = pair.turn
        c, s = np.cos(moved[:, 2]), np.sin(moved[:, 2])
        moved[:, 0] += c * motion_mav[0] - s * motion_mav[1]
        moved[:, 1] += s * motion_mav[0] + c * motion_mav[1]
        moved[:, :2] += self._local.motion_noise_m * self._rng.normal(size=(m, 2))
        return moved

    def _redraw(self, particles: F64, volume: CostVolume | None) -> F64:
        """Replace a share of the particles by draws from the current cost map.
        Costs weigh them together with those that were there before."""
        count = round(self._local.redrawn_fraction * len(particles))
        if volume is None or not volume.feasible or count == 0:
            return particles
        drawn = volume.draw(count, self._sigma_of(volume.costs), self._rng)
        kept = self._rng.permutation(len(particles))[count:]
        return np.concatenate([particles[kept], drawn])

    def _summarize(self, pair: HeightMapPair, together: HeightMapPair, particles: F64) -> Belief:
        """What the particles say of one map. The reported pose is that where all of the newest
        surfaces fit best `together`."""
        counted = particles
        if self._local.estimate == "mode":
            counted = particles[densest_mode(particles)]
        estimate = mean_pose(counted)
        overlay = pair.overlay(estimate[None])
        # Judged where the particles are: no search for a better fit has favoured that place.
        refusal = self._why_refused(pair, particles, estimate, overlay)
        if self._local.estimate == "mode":
            estimate = together.lowest_nearby(estimate)
            overlay = pair.overlay_as_posed(estimate)
            offset = float(together.overlay_as_posed(estimate).height_offsets()[0])
        else:
            offset = float(overlay.height_offsets()[0])
        return Belief(
            stamp_ns=pair.stamp_ns,
            particles=particles,
            estimate=estimate,
            covariance=np.cov(particles[:, :2].T) + pair.pose_errors.covariance(estimate),
            cost=float(pair.costs_as_posed(estimate[None])[0]),
            height_offset=offset,
            T_ground_mav=motion_at(estimate, pair.position_mav, offset),
            converged=not refusal,
            refusal=refusal,
            overlap=float(overlay.overlaps()[0]),
        )

    def _why_refused(
        self, pair: HeightMapPair, particles: F64, estimate: F64, overlay: Overlays
    ) -> str:
        offset = float(overlay.height_offsets()[0])
        T_ground_mav = motion_at(estimate, pair.position_mav, offset)
        cells_per_m = pair.ground.cells_per_m
        laid = make_height_map(T_ground_mav @ pair.points_mav, cells_per_m)
        agreed = newest_agreed = agreement(laid, pair.ground)
        if pair.newest is not None:
            newest = make_height_map(T_ground_mav @ pair.newest.points_mav, cells_per_m)
            newest_agreed = agreement(newest, pair.ground)
        fit = Fit(overlay, agreed, pair.newest_overlap(estimate), newest_agreed)
        if self._local.in_nat:
            # Without a cost, as little is known as by chance.
            evidence = -float(np.nan_to_num(pair.costs(estimate[None])[0]))
            fit = replace(fit, evidence=evidence, lead=pair.volume.lead(estimate))
        refusal = why_refused(fit, particles, self._local)
        return refusal or why_ambiguous(pair.aerial, laid, pair.ground, self._local)


def motion_at(estimate: F64, position_mav: F64, height_offset: float) -> SE3:
    """T_ground_mav that brings the camera at `position_mav` to the estimate (x, y, heading)."""
    turned = SE3.from_heading(estimate[2])
    translation = np.array([*estimate[:2], 0.0]) - turned @ position_mav
    translation[2] = height_offset if np.isfinite(height_offset) else 0.0
    return SE3(turned.rotation, translation)
