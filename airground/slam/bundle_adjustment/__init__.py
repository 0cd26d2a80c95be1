"""Windowed and global bundle adjustment: reprojection, inverse depth and IMU (Sec. IV)."""

from airground.slam.bundle_adjustment.problem import (
    Adjustment,
    InertialFactor,
    Observations,
    Role,
    Settings,
    States,
)
from airground.slam.bundle_adjustment.solver import Pieces, adjust, adjusting

__all__ = [
    "Adjustment",
    "InertialFactor",
    "Observations",
    "Pieces",
    "Role",
    "Settings",
    "States",
    "adjust",
    "adjusting",
]
