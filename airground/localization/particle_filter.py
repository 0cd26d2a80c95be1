"""Monte Carlo localization of the MAV in the ground robot's map (Sec. VI-B).

Whether a belief may claim a position: Sec. VIII-C, and what the paper leaves open."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

import numpy as np

from airground.config import Config, Localization
from airground.core.agreement import Agreement, agreement
from airground.core.arrays import F64, Floats
from airground.core.belief import Belief
from airground.core.events import BeliefUpdated, CostMapComputed, Event, HeightMapsMade
from airground.core.height_map import make_height_map
from airground.core.se3 import SE3
from airground.localization.cost_map import Overlays
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.hypotheses import CostVolume
from airground.localization.nearby_minimum import lowest_nearby
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
        self._newest: deque[HeightMapPair] = deque(maxlen=self._local.maps_together)
        self.belief: Belief | None = None

    def update(self, pair: HeightMapPair) -> Iterator[Event]:
        """Take in one aerial surface and the ground map, under this filter's parameters.

        Yields:
            HeightMapsMade, CostMapComputed (where all of it is computed), BeliefUpdated.

        Raises:
            InputError: The heading is needed and unknown, or the resolutions differ.
        """
        self._newest.append(pair)
        pair = pair.joined(tuple(self._newest)[:-1])
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
            costs = pair.overlay(moved).costs(self._local)
            particles = moved[resample(weights(costs, self._sigma_of(costs)), self._rng)]

        self.belief = self._summarize(pair, particles)
        if volume is None or volume.feasible or self._particles is not None:
            # Else nothing overlapped yet, and the next surface is the first one again.
            self._particles = self._redraw(particles, volume)
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
        They join after the belief was summarized: the next aerial map judges them first."""
        count = round(self._local.redrawn_fraction * len(particles))
        if volume is None or not volume.feasible or count == 0:
            return particles
        drawn = volume.draw(count, self._sigma_of(volume.costs), self._rng)
        kept = self._rng.permutation(len(particles))[count:]
        return np.concatenate([particles[kept], drawn])

    def _summarize(self, pair: HeightMapPair, particles: F64) -> Belief:
        counted = particles
        if self._local.estimate == "mode":
            counted = particles[densest_mode(particles)]
        estimate = mean_pose(counted)
        overlay = pair.overlay(estimate[None])
        # Judged where the particles are: no search for a better fit has favoured that place.
        refusal = self._why_refused(pair, particles, estimate, overlay)
        if pair.searched and self._local.estimate == "mode":
            estimate = lowest_nearby(pair.aerial, pair.ground, estimate, self._local)
            overlay = pair.overlay(estimate[None])
        offset = float(overlay.height_offsets()[0])
        return Belief(
            stamp_ns=pair.stamp_ns,
            particles=particles,
            estimate=estimate,
            covariance=np.cov(particles[:, :2].T) + pair.pose_errors.covariance(estimate[2]),
            cost=float(overlay.costs(self._local)[0]),
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
        laid = make_height_map(T_ground_mav @ pair.points_mav, pair.ground.cells_per_m)
        newest = pair.newest_overlap(estimate)
        agreed = agreement(laid, pair.ground)
        refusal = why_refused(overlay, newest, agreed, particles, self._local)
        return refusal or why_ambiguous(pair.aerial, laid, pair.ground, self._local)


def motion_at(estimate: F64, position_mav: F64, height_offset: float) -> SE3:
    """T_ground_mav that brings the camera at `position_mav` to the estimate (x, y, heading)."""
    turned = SE3.from_heading(estimate[2])
    translation = np.array([*estimate[:2], 0.0]) - turned @ position_mav
    translation[2] = height_offset if np.isfinite(height_offset) else 0.0
    return SE3(turned.rotation, translation)


def why_refused(
    overlay: Overlays,
    newest_overlap: float,
    agreed: Agreement,
    particles: F64,
    config: Localization,
) -> str:
    """The reason, in one line, why no position is claimed; empty if one is.
    Its kind comes first: no overlap, no structure, particles split or heights disagree.

    The covariance says whether particles agree with each other, not whether they are right: the
    rest asks whether the maps fit at the estimate, better than beside it.

    Args:
        overlay, agreed: Overlap and agreement of the two maps at the estimate.
        newest_overlap: Overlap of the newest surface alone there.
        particles: (M, 3) particles: x, y [m] and heading [rad].
        config: Section `localization` of the configuration.
    """
    overlap = float(overlay.overlaps()[0])
    if not overlap > config.min_overlap:
        return f"no overlap: only {overlap:.0%} of the aerial map lies on the ground map"
    if newest_overlap < config.min_claimed_overlap:
        return (
            f"no overlap: only {newest_overlap:.0%} of the newest aerial map lies on the ground "
            f"map, {config.min_claimed_overlap:.0%} are needed for a claim"
        )
    relief = float(overlay.reliefs()[0])
    if relief < config.min_relief_m:
        return f"no structure: heights deviate by {1000 * relief:.0f} mm where the maps overlap"
    refusal = _why_spread(particles, config)
    if refusal:
        return refusal
    correlation = float(overlay.correlations()[0])
    if correlation < config.min_correlation:
        return f"heights disagree: at the estimate they correlate by {correlation:.2f} only"
    evidence = -float(overlay.costs(config)[0])
    if config.cost == "likelihood" and evidence < config.min_evidence:
        return (
            f"heights disagree: that they correlate by {correlation:.2f} over {overlap:.0%} of the "
            f"aerial map may be chance ({evidence:.0f} nat, {config.min_evidence:g} are enough)"
        )
    if agreed.kappa < config.min_agreement:
        return (
            f"heights disagree: they agree over {agreed.share:.0%} at the estimate, "
            f"and over {agreed.chance:.0%} beside it, which may be chance"
        )
    return ""


def _why_spread(particles: F64, config: Localization) -> str:
    """Refuses particles that are spread; with `mode`, a minority elsewhere is allowed."""
    counted = particles
    if config.estimate == "mode":
        mode = densest_mode(particles)
        if mode.mean() < config.min_mode_share:
            return f"particles split: only {mode.mean():.0%} of them agree on a place"
        counted = particles[mode]
    if len(counted) < 2:
        return "particles split: no two of them agree on a place"
    spread_m = float(np.sqrt(np.trace(np.cov(counted[:, :2].T))))
    if spread_m > config.converged_spread_m:
        return f"particles split: they are still spread over {spread_m:.2f} m"
    return ""
