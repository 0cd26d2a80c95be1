"""Height maps of an aerial surface and of the ground, and what they say together (Sec. VI-A)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from airground.config import Config, HeightMaps
from airground.core.arrays import F32, F64
from airground.core.belief import HeightMap
from airground.core.height_map import make_height_map
from airground.errors import InputError
from airground.localization.channels import ChannelOverlay
from airground.localization.cost_map import Overlays, overlay_at, overlay_turned, reach_of
from airground.localization.hypotheses import CostVolume, search_headings, search_positions
from airground.localization.nearby_minimum import lowest_nearby
from airground.localization.pose_errors import PoseErrors


@dataclass(frozen=True, eq=False)
class HeightMapPair:
    """An aerial surface and the ground map of its time, for one or several filters.

    Height maps are computed on first use, and kept.

    Attributes:
        stamp_ns: Stamp of the surface [ns].
        points_mav: (N, 3) points of the surface in `mav` [m], or of several.
        position_mav: (3,) position of the newest surface's camera in `mav` [m].
        points_ground: (M, 3) points of the ground robot's map in `ground` [m].
        ground_robot_position: (2,) centre of the search region in `ground` [m].
        heading: Turn of `mav` in `ground` [rad]; not used where it is searched.
        config: The pipeline's parameters; height maps and localization are used.
        pose_errors: How well both robots' poses, and the ground map's scale, are known.
        newest: The pair of the newest surface alone; None where the surface is that one.
    """

    stamp_ns: int
    points_mav: F32
    position_mav: F64
    points_ground: F32
    ground_robot_position: F64
    heading: float | None
    config: Config
    pose_errors: PoseErrors = field(default_factory=PoseErrors.none)
    newest: HeightMapPair | None = None
    _joined: dict[tuple[int, ...], HeightMapPair] = field(default_factory=dict, repr=False)

    def joined(self, earlier: Sequence[HeightMapPair]) -> HeightMapPair:
        """The surfaces of earlier pairs and this one as one surface, over this ground map.
        All surfaces of a flight lie in one frame, which the MAV's SLAM keeps."""
        if not earlier:
            return self
        stamps = tuple(pair.stamp_ns for pair in earlier)
        if stamps not in self._joined:
            points = np.concatenate([pair.points_mav for pair in (*earlier, self)])
            self._joined[stamps] = replace(self, points_mav=points, newest=self, _joined={})
        return self._joined[stamps]

    def newest_overlap(self, particle: F64) -> float:
        """Share of the newest surface's filled cells over the ground map at x, y [m], heading."""
        return float((self.newest or self).overlay(particle[None]).overlaps()[0])

    @property
    def searched(self) -> bool:
        """Whether the heading is one of the unknowns."""
        return self.config.localization.heading == "search"

    @cached_property
    def turn(self) -> float:
        """Turn of `mav` for the aerial height map [rad]; 0 where it is searched.
        InputError if it is needed and unknown."""
        if self.searched:
            return 0.0
        if self.heading is None or not np.isfinite(self.heading):
            raise InputError(
                f"stamp {self.stamp_ns}: the heading of the MAV's map in the ground robot's is "
                "unknown; give one, or set localization.heading to 'search'"
            )
        return float(self.heading)

    @cached_property
    def aerial(self) -> HeightMap:
        """Heights around the MAV's camera."""
        return aerial_height_map(
            self.points_mav, self.position_mav, self.turn, self.config.height_maps
        )

    @cached_property
    def ground(self) -> HeightMap:
        """Heights of the ground map, as far as the aerial one may reach."""
        reach_cells = float(np.linalg.norm(reach_of(self.aerial), axis=1).max() + 2)
        reach_m = reach_cells / self.aerial.cells_per_m
        reach_m += self.config.localization.search_radius_m
        return ground_height_map(
            self.points_ground, self.ground_robot_position, reach_m, self.config.height_maps
        )

    @cached_property
    def volume(self) -> CostVolume:
        """Costs of all hypotheses (Eq. 2)."""
        robot, local = self.ground_robot_position, self.config.localization
        if self.searched:
            return search_headings(self.aerial, self.ground, robot, local)
        return search_positions(self.aerial, self.ground, robot, self.turn, local)

    def overlay(self, particles: F64) -> Overlays:
        """The aerial heights laid on the ground's at each of (M, 3) x, y [m] and heading [rad]."""
        if self.searched:
            return overlay_turned(self.aerial, self.ground, particles)
        return overlay_at(self.aerial, self.ground, particles[:, :2])

    def costs(self, particles: F64) -> F32:
        """(M,) costs at each of (M, 3) x, y [m] and heading [rad]; NaN where little overlaps."""
        local = self.config.localization
        if local.cost == "channels":
            return self.costs_as_posed(particles)
        return self.overlay(particles).costs(local)

    def costs_as_posed(self, poses: F64) -> F32:
        """The same of poses whose heading need not be the known one."""
        return self._costs_turned(poses - self._turned)

    def _costs_turned(self, poses: F64) -> F32:
        """(M,) costs of the aerial height map turned by poses (M, 3) further."""
        local = self.config.localization
        if local.cost == "channels":
            return self._channels.costs(poses, local)
        return overlay_turned(self.aerial, self.ground, poses).costs(local)

    @cached_property
    def _channels(self) -> ChannelOverlay:
        return ChannelOverlay.of(self.aerial, self.ground)

    def overlay_as_posed(self, pose: F64) -> Overlays:
        """The aerial heights laid on the ground's at x, y [m] and heading [rad], which need not be
        the known one."""
        return overlay_turned(self.aerial, self.ground, (pose - self._turned)[None])

    def lowest_nearby(self, estimate: F64) -> F64:
        """The pose (3,) around an estimate at which the heights fit best. A known heading is turned
        too: magnetometers are off by a degree or two."""
        relative = estimate - self._turned
        sigma = self.config.localization.sigma
        found = lowest_nearby(self.aerial, self.ground, relative, self._costs_turned, sigma)
        return found + self._turned

    @property
    def _turned(self) -> F64:
        """What the aerial height map is turned by already, as a pose."""
        return np.array([0.0, 0.0, self.turn])


def aerial_height_map(
    points_mav: F32, position_mav: F64, heading: float, config: HeightMaps
) -> HeightMap:
    """Heights of an aerial surface around the camera that saw it (Fig. 7a).

    Args:
        points_mav: (N, 3) [m] in the frame `mav`.
        position_mav: (3,) the reference camera in `mav` [m].
        heading: Turn of the frame `mav` in `ground` [rad].
        config: Resolution and hole filling.

    Returns:
        x and y relative to the camera along the axes of `ground`, to which a hypothesis u is
        added; heights as in `mav`.
    """
    c, s = np.cos(heading), np.sin(heading)
    offsets = np.asarray(points_mav, np.float64)[:, :2] - np.asarray(position_mav)[:2]
    points = np.empty((len(offsets), 3), np.float32)
    points[:, 0] = c * offsets[:, 0] - s * offsets[:, 1]
    points[:, 1] = s * offsets[:, 0] + c * offsets[:, 1]
    points[:, 2] = np.asarray(points_mav)[:, 2]
    return make_height_map(points, config.cells_per_m, config.dilate_holes)


def ground_height_map(
    points_ground: F32, centre: F64, reach_m: float, config: HeightMaps
) -> HeightMap:
    """Heights of points (N, 3) in `ground` over a square of half side `reach_m` (Fig. 7b)."""
    window = (np.asarray(centre) - reach_m, np.asarray(centre) + reach_m)
    return make_height_map(points_ground, config.cells_per_m, config.dilate_holes, window)
