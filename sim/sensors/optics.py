"""Lens and shutter of a camera: what a user chooses, and the calibration that follows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from airground.io.calibration import CameraTable
from airground.io.lens import Model

LensKind = Literal["pinhole", "radtan", "equidistant"]


@dataclass(frozen=True)
class Radtan:
    """A measured radial-tangential lens.

    Attributes:
        coefficients: In OpenCV's order.
        focal_px: Focal length that they were measured with [px].
    """

    coefficients: tuple[float, ...]
    focal_px: float

    def for_focal(self, focal_px: float, factor: float) -> tuple[float, ...]:
        """The coefficients by which each pixel is displaced by `factor` times as much, with
        another focal length and the same size of image."""
        zoom = focal_px / self.focal_px
        terms = zip(self.coefficients, RADTAN_POWERS, strict=False)
        return tuple(float(factor * k * zoom**power) for k, power in terms)


RADTAN_POWERS = (2, 4, 1, 1, 6)
"""Powers of the radius in the relative displacement by k1, k2, p1, p2 and k3."""
EUROC_RADTAN = Radtan((-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05), 458.654)
"""EuRoC's cam0 (Burri et al., IJRR 2016): barrel distortion of a lens of 80 degrees."""
KINECT_RADTAN = Radtan((0.2312, -0.7849, -0.0033, -0.0001, 0.9172), 520.9)
"""The colour camera of TUM RGB-D's freiburg2 (Sturm et al., IROS 2012), a Kinect."""
TUM_VI_EQUIDISTANT = (0.0034823894, 0.00071503484, -0.0020532361, 0.00020293673)
"""cam0 of TUM VI (Schubert et al., IROS 2018)."""
FISHEYE_FIELD_DEG = 150.0
"""Field of view of the fisheye from corner to corner [deg]. Depth along the optical axis, which
is what recordings hold, has no meaning at 180."""


@dataclass(frozen=True)
class Optics:
    """Lens and shutter of one camera.

    Attributes:
        lens: Kind of the lens.
        distortion: Factor on the coefficients of the lens; 1 is the measured one.
        readout_s: Time from the first to the last row [s]; 0 for a global shutter.
    """

    lens: LensKind = "pinhole"
    distortion: float = 1.0
    readout_s: float = 0.0

    def applied_to(self, camera: CameraTable, radtan: Radtan) -> CameraTable:
        """The true calibration of a pinhole camera once it has this lens and shutter.

        A fisheye has a focal length of its own, which gives `FISHEYE_FIELD_DEG`.

        Args:
            camera: Pinhole camera, with the principal point in its middle.
            radtan: The robot's radial-tangential lens.
        """
        table = _changed(camera, readout_s=self.readout_s)
        if self.lens == "pinhole":
            return table
        if self.lens == "radtan":
            coefficients = radtan.for_focal(camera.fx, self.distortion)
            return _with_distortion(table, "radial-tangential", coefficients)
        scaled = tuple(self.distortion * k for k in TUM_VI_EQUIDISTANT)
        bent = _with_distortion(table, "equidistant", scaled)
        angle = np.deg2rad(FISHEYE_FIELD_DEG) / 2
        k = np.array(bent.distortion_coefficients)
        radius = angle * float(np.polyval([*k[::-1], 1.0], angle**2))
        focal_px = float(np.hypot(camera.width, camera.height)) / 2 / radius
        return _changed(bent, fx=focal_px, fy=focal_px)


PINHOLE = Optics()
"""No distortion, and a global shutter."""


def misjudged(true: CameraTable, focal_factor: float, distortion_factor: float) -> CameraTable:
    """The nominal calibration of a camera: focal lengths and coefficients by these factors off,
    and a clock without offset."""
    coefficients = tuple(distortion_factor * k for k in true.distortion_coefficients)
    return _changed(
        true,
        fx=true.fx * focal_factor,
        fy=true.fy * focal_factor,
        distortion_coefficients=coefficients,
        time_offset_ns=0,
    )


def _with_distortion(
    camera: CameraTable, model: Model, coefficients: tuple[float, ...]
) -> CameraTable:
    return _changed(camera, distortion_model=model, distortion_coefficients=coefficients)


def _changed(camera: CameraTable, **change: object) -> CameraTable:
    return CameraTable.model_validate({**camera.model_dump(), **change})
