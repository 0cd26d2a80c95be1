"""Aerial surfaces of a run without truth: their outcome, and their error against measured depth.

A MAV's folder with depth images, such as a TUM RGB-D folder, has the depth of each reference view
measured. The pipeline never sees it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airground.core.cloud import PointCloud
from airground.core.events import Aligned, BeliefUpdated, NotLocated, Sighted, SurfaceCast
from airground.core.messages import MavImage
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface
from airground.io.robot_recording import RobotRecording
from evaluation.run.onlooker import Seen

KEPT = 3
"""Surfaces that are kept whole for pictures: as many as a page shows."""


@dataclass(frozen=True, eq=False)
class LoggedSurface:
    """One aerial surface with its outcome.

    Attributes:
        surface: The fused surface.
        image: (H, W) uint8 reference view, undistorted.
        measured: (height, width) float32 measured depth of the surface's view [m], NaN where
            missing; None where the recording has no depth.
        ground_cloud: The ground robot's map at that time; None where a robot was lost.
        T_ground_mav: Alignment, else position claimed; None without either.
        outcome: "aligned", or the reason why not.
    """

    surface: AerialSurface
    image: NDArray[np.uint8]
    measured: NDArray[np.float32] | None
    ground_cloud: PointCloud | None = None
    T_ground_mav: SE3 | None = None
    outcome: str = "not located"

    @property
    def aligned(self) -> bool:
        """Whether refinement accepted an alignment."""
        return self.outcome == "aligned"

    @property
    def error(self) -> NDArray[np.float32] | None:
        """(height, width) fused depth minus measured depth [m], NaN where one is missing."""
        return None if self.measured is None else self.surface.depth - self.measured


@dataclass(frozen=True)
class AgainstMeasured:
    """Error of one surface against measured depth.

    Attributes:
        median_m, p90_m: Quantiles of the absolute depth difference [m].
        completeness: Share of the pixels with measured depth that have a fused one.
    """

    median_m: float
    p90_m: float
    completeness: float

    @classmethod
    def of(cls, logged: LoggedSurface) -> AgainstMeasured | None:
        """None where the two have no pixel in common."""
        error = logged.error
        if error is None or not np.isfinite(error).any():
            return None
        size = np.abs(error[np.isfinite(error)])
        median, p90 = np.quantile(size, [0.5, 0.9])
        known = np.isfinite(logged.measured).sum() if logged.measured is not None else 0
        return cls(float(median), float(p90), float(len(size) / known))


@dataclass(eq=False)
class SurfaceLog:
    """An onlooker that compares surfaces with measured depth and keeps some for pictures.

    Attributes:
        recording: The MAV's recording.
        errors: Error of each surface that could be compared, in order of time.
    """

    recording: RobotRecording[MavImage]
    errors: list[AgainstMeasured] = field(default_factory=list)
    _kept: list[LoggedSurface] = field(default_factory=list)
    _newest: LoggedSurface | None = None

    def see(self, seen: Seen) -> None:
        """Log one event."""
        match seen.event:
            case SurfaceCast(surface=surface):
                self._keep_newest()
                self._newest = self._logged(surface)
                error = AgainstMeasured.of(self._newest)
                self.errors += [error] if error is not None else []
            case Sighted(sighting=sighting):
                self._change(ground_cloud=sighting.ground_cloud)
            case NotLocated(reason=reason):
                self._change(outcome=reason)
            case BeliefUpdated(belief=belief) if not belief.converged:
                self._change(outcome=belief.refusal)
            case BeliefUpdated(belief=belief):
                self._change(T_ground_mav=belief.T_ground_mav)
            case Aligned(alignment=alignment):
                outcome = "aligned" if alignment.accepted else alignment.refusal
                self._change(T_ground_mav=alignment.T_ground_mav, outcome=outcome)

    def shown(self) -> list[LoggedSurface]:
        """Surfaces for pictures, in order of time: aligned ones before others."""
        self._keep_newest()
        return sorted(self._kept, key=lambda logged: logged.surface.stamp_ns)

    def summary(self) -> dict[str, float | int] | None:
        """Number of compared surfaces, and medians of their errors; None without any."""
        if not self.errors:
            return None
        rows = [(one.median_m, one.p90_m, one.completeness) for one in self.errors]
        median_m, p90_m, completeness = np.median(rows, axis=0).tolist()
        return {
            "compared": len(rows),
            "error_median_m": median_m,
            "error_p90_m": p90_m,
            "completeness": completeness,
        }

    def _logged(self, surface: AerialSurface) -> LoggedSurface:
        stamp_ns = surface.reference_stamp_ns
        image = self.recording.image_at(stamp_ns).image
        return LoggedSurface(surface, image, measured_depth(self.recording, surface))

    def _change(self, **changes: Any) -> None:
        if self._newest is not None:
            self._newest = replace(self._newest, **changes)

    def _keep_newest(self) -> None:
        if self._newest is None:
            return
        self._kept.append(self._newest)
        self._newest = None
        if len(self._kept) > KEPT:
            others = [index for index, one in enumerate(self._kept) if not one.aligned]
            del self._kept[others[0] if others else KEPT]


def measured_depth(
    recording: RobotRecording[MavImage], surface: AerialSurface
) -> NDArray[np.float32] | None:
    """(height, width) float32 measured depth [m] at the pixels of a surface's view, of the nearest
    pixel; NaN where missing. None where the recording has no depth."""
    if recording.read_depth is None:
        return None
    index = int(np.searchsorted(recording.camera_stamps, surface.reference_stamp_ns))
    depth = recording.read_depth(index)
    rays = surface.camera.rays().reshape(-1, 3)
    x, y = np.rint(recording.calibration.camera.project(rays)).astype(int).T
    inside = (x >= 0) & (y >= 0) & (x < depth.shape[1]) & (y < depth.shape[0])
    found = np.full(len(rays), np.nan, np.float32)
    found[inside] = depth[y[inside], x[inside]]
    return found.reshape(surface.depth.shape)
