"""Monte Carlo localization of the MAV in the ground robot's map (Sec. VI-B)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from airground.config import Config
from airground.core.agreement import agreement
from airground.core.belief import Belief, HeightMap
from airground.core.events import BeliefUpdated, CostMapComputed, Event, HeightMapsMade
from airground.core.height_map import make_height_map
from airground.core.se3 import SE3
from airground.errors import InputError
from airground.localization.acceptance import why_refused
from airground.localization.cost_map import Overlays, overlay_at, overlay_turned, reach_of
from airground.localization.height_map import aerial_height_map, ground_height_map
from airground.localization.hypotheses import CostVolume, search_headings, search_positions
from airground.localization.particles import densest_mode, mean_pose, resample, span, weights


class MonteCarloLocalizer:
    """A belief over u, the position (and heading) of the MAV's camera in `ground`.

    Args:
        config: The pipeline's parameters; height maps and localization are used.
        rng: The one source of randomness.

    Attributes:
        belief: After the newest aerial surface, None before the first.
    """

    def __init__(self, config: Config, rng: np.random.Generator) -> None:
        self._height_maps = config.height_maps
        self._local = config.localization
        self._searched = config.localization.heading == "search"
        self._rng = rng
        self._particles: NDArray[np.float64] | None = None
        self._position_mav = np.zeros(3)
        self.belief: Belief | None = None

    def update(
        self,
        stamp_ns: int,
        points_mav: NDArray,
        position_mav: NDArray,
        ground_map: HeightMap | NDArray,
        ground_robot_position: NDArray,
        heading: float | None,
    ) -> Iterator[Event]:
        """Take in one aerial surface.

        Args:
            stamp_ns: Of the surface.
            points_mav: (N, 3) its points in `mav` [m].
            position_mav: (3,) the camera that it was seen from, in `mav` [m].
            ground_map: (N, 3) the ground robot's points in `ground` [m], or their height map.
            ground_robot_position: (2,) middle of the search region in `ground` [m].
            heading: Turn of `mav` in `ground` [rad]; not used where it is searched.

        Yields:
            HeightMapsMade, CostMapComputed (where all of it is computed), BeliefUpdated.

        Raises:
            InputError: The heading is needed and unknown, or the resolutions differ.
        """
        turn = self._heading(stamp_ns, heading)
        position_mav = np.array(position_mav, np.float64)
        aerial = aerial_height_map(points_mav, position_mav, turn, self._height_maps)
        ground = self._ground_height_map(ground_map, ground_robot_position, aerial)
        yield HeightMapsMade(stamp_ns, aerial, ground)

        # Costs of all hypotheses: for the first particles, and for those drawn anew.
        volume = None
        if self._particles is None or self._local.redrawn_fraction > 0:
            volume = self._search(aerial, ground, ground_robot_position, turn)
            yield CostMapComputed(stamp_ns, volume.cost_map(self._local.cost))

        if self._particles is None:
            assert volume is not None
            sigma = self._sigma_of(volume.costs)
            particles = volume.draw(self._local.particles, sigma, self._rng)
        else:
            moved = self._move(self._particles, position_mav - self._position_mav, turn)
            costs = self._overlay(aerial, ground, moved).costs(self._local)
            particles = moved[resample(weights(costs, self._sigma_of(costs)), self._rng)]

        self.belief = self._summarize(
            stamp_ns, particles, np.asarray(points_mav), position_mav, aerial, ground
        )
        if volume is None or volume.feasible or self._particles is not None:
            # Else nothing overlapped yet, and the next surface is the first one again.
            self._particles = self._redraw(particles, volume)
        self._position_mav = position_mav
        yield BeliefUpdated(stamp_ns, self.belief)

    def _heading(self, stamp_ns: int, heading: float | None) -> float:
        if self._searched:
            return 0.0
        if heading is None or not np.isfinite(heading):
            raise InputError(
                f"stamp {stamp_ns}: the heading of the MAV's map in the ground robot's is unknown; "
                "give one, or set localization.heading to 'search'"
            )
        return float(heading)

    def _ground_height_map(
        self, ground_map: HeightMap | NDArray, robot: NDArray, aerial: HeightMap
    ) -> HeightMap:
        if isinstance(ground_map, HeightMap):
            if ground_map.cells_per_m != self._height_maps.cells_per_m:
                raise InputError(
                    f"ground height map: {ground_map.cells_per_m:g} cells/m, expected "
                    f"{self._height_maps.cells_per_m:g} (height_maps.cells_per_m)"
                )
            return ground_map
        reach_m = float(np.linalg.norm(reach_of(aerial), axis=1).max() + 2) / aerial.cells_per_m
        reach_m += self._local.search_radius_m
        return ground_height_map(ground_map, robot, reach_m, self._height_maps)

    def _search(
        self, aerial: HeightMap, ground: HeightMap, robot: NDArray, turn: float
    ) -> CostVolume:
        if self._searched:
            return search_headings(aerial, ground, robot, self._local)
        return search_positions(aerial, ground, robot, turn, self._local)

    def _overlay(self, aerial: HeightMap, ground: HeightMap, particles: NDArray) -> Overlays:
        if self._searched:
            return overlay_turned(aerial, ground, particles)
        return overlay_at(aerial, ground, particles[:, :2])

    def _sigma_of(self, costs: NDArray) -> float:
        """Sigma of Eq. 5 in units of the costs that it is used on."""
        scale = span(costs) if self._local.sigma_units == "minmax" else 1.0
        return self._local.sigma * scale

    def _move(self, particles: NDArray, motion_mav: NDArray, turn: float) -> NDArray[np.float64]:
        """Eq. 6: the motion that the MAV's SLAM saw, turned into `ground`, plus noise."""
        m = len(particles)
        moved = particles.copy()
        if self._searched:
            moved[:, 2] += np.deg2rad(self._local.heading_noise_deg) * self._rng.normal(size=m)
        else:
            moved[:, 2] = turn
        c, s = np.cos(moved[:, 2]), np.sin(moved[:, 2])
        moved[:, 0] += c * motion_mav[0] - s * motion_mav[1]
        moved[:, 1] += s * motion_mav[0] + c * motion_mav[1]
        moved[:, :2] += self._local.motion_noise_m * self._rng.normal(size=(m, 2))
        return moved

    def _redraw(self, particles: NDArray, volume: CostVolume | None) -> NDArray[np.float64]:
        """Replace a share of the particles by draws from the current cost map.

        They join after the belief was summarized: the next aerial map judges them first.
        """
        count = round(self._local.redrawn_fraction * len(particles))
        if volume is None or not volume.feasible or count == 0:
            return particles
        drawn = volume.draw(count, self._sigma_of(volume.costs), self._rng)
        kept = self._rng.permutation(len(particles))[count:]
        return np.concatenate([particles[kept], drawn])

    def _summarize(
        self,
        stamp_ns: int,
        particles: NDArray,
        points_mav: NDArray,
        position_mav: NDArray,
        aerial: HeightMap,
        ground: HeightMap,
    ) -> Belief:
        counted = particles
        if self._local.estimate == "mode":
            counted = particles[densest_mode(particles)]
        estimate = mean_pose(counted)
        overlay = self._overlay(aerial, ground, estimate[None])
        offset = float(overlay.height_offsets()[0])
        T_ground_mav = motion_at(estimate, position_mav, offset)
        laid = make_height_map(T_ground_mav @ points_mav, ground.cells_per_m)
        refusal = why_refused(overlay, agreement(laid, ground), particles, self._local)
        return Belief(
            stamp_ns=stamp_ns,
            particles=particles,
            estimate=estimate,
            covariance=np.cov(particles[:, :2].T),
            cost=float(overlay.costs(self._local)[0]),
            height_offset=offset,
            T_ground_mav=T_ground_mav,
            converged=not refusal,
            refusal=refusal,
        )


def motion_at(estimate: NDArray, position_mav: NDArray, height_offset: float) -> SE3:
    """T_ground_mav that brings the camera at `position_mav` to the estimate (x, y, heading)."""
    turned = SE3.from_heading(estimate[2])
    translation = np.array([*estimate[:2], 0.0]) - turned @ position_mav
    translation[2] = height_offset if np.isfinite(height_offset) else 0.0
    return SE3(turned.rotation, translation)
