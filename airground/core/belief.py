"""What localization works on and what it believes: height maps, cost maps, particles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.core.arrays import F32, F64, freeze
from airground.core.se3 import SE3


@dataclass(frozen=True, eq=False)
class HeightMap:
    """Highest point over each cell of a horizontal grid (Sec. VI-A).

    Attributes:
        heights: (nx, ny) float32 [m], x first, NaN where nothing was seen.
        origin: (2,) float64 [m], centre of cell [0, 0] in the frame of the points.
        cells_per_m: Resolution.
    """

    heights: F32
    origin: F64
    cells_per_m: float

    def __post_init__(self) -> None:
        freeze(self, "heights", (None, None), np.float32)
        freeze(self, "origin", (2,), np.float64)
        if not self.cells_per_m > 0:
            raise ValueError(f"cells_per_m must be positive, got {self.cells_per_m}")

    @property
    def filled_cells(self) -> int:
        return int(np.isfinite(self.heights).sum())


@dataclass(frozen=True, eq=False)
class CostMap:
    """Cost of every position u of the MAV's reference camera (Eq. 2, Fig. 7c).

    Attributes:
        costs: (nx, ny) float32, NaN where the overlap is too small. Low is good.
        origin: (2,) float64 [m], the u of cell [0, 0] in the frame `ground`.
        cells_per_m: Resolution.
        heading: Turn of `mav` in `ground` [rad]; if searched, that of the lowest cost.
        cost: Kind of cost: "zmssd" [m^2], "ncc" [1 - correlation], "likelihood" or "channels"
            [nat].
    """

    costs: F32
    origin: F64
    cells_per_m: float
    heading: float
    cost: str

    def __post_init__(self) -> None:
        freeze(self, "costs", (None,) * 2, np.float32)
        freeze(self, "origin", (2,), np.float64)

    def best(self) -> F64 | None:
        """(2,) the u of lowest cost [m] (Eq. 3), or None where no overlap suffices."""
        if not np.isfinite(self.costs).any():
            return None
        cell = np.unravel_index(np.nanargmin(self.costs), self.costs.shape)
        return self.origin + np.array(cell, np.float64) / self.cells_per_m


@dataclass(frozen=True, eq=False)
class Belief:
    """Where the MAV's reference camera is in the frame `ground`, as particles (Eq. 4).

    Attributes:
        stamp_ns: Stamp of the newest aerial surface in this belief [ns].
        particles: (M, 3) float64: x, y [m] and heading [rad] of `mav` in `ground`.
        estimate: (3,) float64: the reported x, y, heading.
        covariance: (2, 2) float64 covariance of x and y [m^2]: of the particles and, beyond what
            they can show, by the errors of the robots' poses.
        cost: Cost at the estimate, NaN where the overlap is too small.
        height_offset: Delta z of Sec. VI-A [m], to be added to heights in `mav`.
        T_ground_mav: The estimate as a motion between the robots' maps.
        converged: Whether a position is claimed.
        refusal: Reason why no position is claimed; empty when converged.
        overlap: Share of the aerial map's filled cells that lie on the ground map at the estimate;
            NaN if read from results that do not have it.
    """

    stamp_ns: int
    particles: F64
    estimate: F64
    covariance: F64
    cost: float
    height_offset: float
    T_ground_mav: SE3
    converged: bool
    refusal: str
    overlap: float = float("nan")

    def __post_init__(self) -> None:
        for name, shape in (("particles", (None, 3)), ("estimate", (3,)), ("covariance", (2, 2))):
            freeze(self, name, shape, np.float64)

    @property
    def spread_m(self) -> float:
        """Standard deviation of the particles' positions [m] (Fig. 12)."""
        return float(np.sqrt(self.particles[:, :2].var(axis=0, ddof=1).sum()))


@dataclass(frozen=True, eq=False)
class Alignment:
    """The MAV's map aligned with the ground robot's (Sec. VII).

    Attributes:
        stamp_ns: Stamp of the aligned aerial surface [ns].
        T_ground_mav: The refined motion between the robots' maps.
        inliers: Share of the aerial points over the ground map that lie on it.
        rmse_m: Root mean square distance of the inliers to the ground map's planes [m].
        accepted: Whether the alignment may be used.
        refusal: Reason of the refusal; empty when accepted.
    """

    stamp_ns: int
    T_ground_mav: SE3
    inliers: float
    rmse_m: float
    accepted: bool
    refusal: str
