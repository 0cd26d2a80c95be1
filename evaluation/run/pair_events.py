"""What a run without truth reports: surfaces, where they were located, and why not."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from airground.config import Config
from airground.core.arrays import F64
from airground.core.belief import Alignment
from airground.core.events import (
    Aligned,
    BeliefUpdated,
    DepthMapMade,
    MavTracked,
    NotLocated,
    SurfaceCast,
)
from evaluation.run.onlooker import Seen


@dataclass(eq=False)
class PairEvents:
    """An onlooker that counts the outcome of every aerial surface.

    Attributes:
        depth_maps, surfaces: Numbers of depth maps and of aerial surfaces.
        located: Number of surfaces after which a position was claimed.
        not_located: Numbers of all others by the kind of reason, in order of appearance.
        alignments: Every refinement, in order of time.
        refused: Numbers of refused alignments by the kind of reason.
        path_m: Length of the path of the MAV's camera [m].
        scale_sigma: Least standard deviation of the MAV's scale [share]; None where poses state
            none.
    """

    depth_maps: int = 0
    surfaces: int = 0
    located: int = 0
    not_located: Counter[str] = field(default_factory=Counter)
    alignments: list[Alignment] = field(default_factory=list)
    refused: Counter[str] = field(default_factory=Counter)
    path_m: float = 0.0
    scale_sigma: float | None = None
    _camera_mav: F64 | None = None
    _newest_reason: str = ""

    def see(self, seen: Seen) -> None:
        """Count one event."""
        match seen.event:
            case MavTracked(T_mav_camera=pose, scale_sigma=sigma):
                if sigma is not None:
                    self.scale_sigma = min(sigma, self.scale_sigma or np.inf)
                if self._camera_mav is not None:
                    self.path_m += float(np.linalg.norm(pose.translation - self._camera_mav))
                self._camera_mav = pose.translation
            case DepthMapMade():
                self.depth_maps += 1
            case SurfaceCast():
                self.surfaces += 1
            case NotLocated(reason=reason):
                self._add(self.not_located, reason)
            case BeliefUpdated(belief=belief) if belief.converged:
                self.located += 1
            case BeliefUpdated(belief=belief):
                self._add(self.not_located, belief.refusal)
            case Aligned(alignment=alignment):
                self.alignments.append(alignment)
                if not alignment.accepted:
                    self._add(self.refused, alignment.refusal)

    def why(self, config: Config) -> str | None:
        """Why nothing was aligned, in words; None where something was."""
        if any(alignment.accepted for alignment in self.alignments):
            return None
        max_sigma = config.view_selection.max_scale_sigma
        if self.scale_sigma is not None and self.scale_sigma > max_sigma:
            known = f"known to {self.scale_sigma:.0%}"
            return (
                "no surface: the scale of the MAV's map is "
                f"{known if np.isfinite(self.scale_sigma) else 'unknown'}, and depth maps need "
                f"{max_sigma:.0%}"
            )
        if self.surfaces == 0:
            return (
                f"no surface: the MAV's camera moved {self.path_m:.2f} m while it was tracked, "
                f"which gave {self.depth_maps} depth maps; a surface needs "
                f"{config.fusion.min_depth_maps} near each other"
            )
        return self._newest_reason or None

    def _add(self, counts: Counter[str], reason: str) -> None:
        counts[reason.partition(":")[0]] += 1
        self._newest_reason = reason
