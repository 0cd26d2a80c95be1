"""A rotating lidar: where its beams point, when each fires, and how well it measures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.errors import InputError

FEWEST_BEAMS, MOST_BEAMS = 16, 128


@dataclass(frozen=True)
class Lidar:
    """A lidar that turns counter-clockwise about its z axis, from its x axis on.

    All beams of a column fire at once; a revolution's columns fire one after the other, evenly.

    Attributes:
        beams: Number of beams, evenly spaced in elevation.
        columns: Firings a revolution.
        rate_hz: Revolutions a second [Hz].
        elevation_deg: Elevation of the lowest and the highest beam [deg].
        range_m: Nearest and farthest range [m].
        noise_m: Standard deviation of a range [m].
        grazing_limit_deg: Angle of incidence from which nothing comes back [deg].
        height_m: How far it stands above the robot's camera [m].
    """

    beams: int = 32
    columns: int = 1024
    rate_hz: float = 10.0
    elevation_deg: tuple[float, float] = (-45.0, 15.0)
    range_m: tuple[float, float] = (0.3, 50.0)
    noise_m: float = 0.01
    grazing_limit_deg: float = 85.0
    height_m: float = 0.15

    def __post_init__(self) -> None:
        if not FEWEST_BEAMS <= self.beams <= MOST_BEAMS:
            raise InputError(f"beams must be from {FEWEST_BEAMS} to {MOST_BEAMS}, got {self.beams}")

    @property
    def revolution_ns(self) -> int:
        return round(1e9 / self.rate_hz)

    def times_ns(self) -> NDArray[np.int64]:
        """(columns,) when each column fires, after the start of the revolution [ns]."""
        return np.arange(self.columns) * self.revolution_ns // self.columns

    def directions(self) -> NDArray[np.float64]:
        """(columns, beams, 3) unit vectors of the beams; the first beam is the lowest."""
        azimuth = np.arange(self.columns)[:, None] * (2 * np.pi / self.columns)
        elevation = np.radians(np.linspace(*self.elevation_deg, self.beams))[None]
        level = np.cos(elevation)
        up = np.broadcast_to(np.sin(elevation), (self.columns, self.beams))
        return np.stack([level * np.cos(azimuth), level * np.sin(azimuth), up], axis=-1)

    def mounting(self, T_body_camera: SE3) -> SE3:
        """`T_body_lidar`: above the camera, with the body's axes."""
        return SE3(np.eye(3), T_body_camera.translation + np.array([0.0, 0.0, self.height_m]))
