"""Windowed and global bundle adjustment: reprojection, inverse depth and IMU (Sec. IV)."""

from airground.slam.bundle_adjustment.problem import (
    Adjustment,
    InertialFactor,
    Observations,
    Role,
    Settings,
    States,
)
from airground.slam.bundle_adjustment.solver import adjust

__all__ = ["Adjustment", "InertialFactor", "Observations", "Role", "Settings", "States", "adjust"]
