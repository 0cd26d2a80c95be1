"""The photometric cost of depth planes, one view after another (Sec. V).

A view is first turned so that it looks the way the reference does. Then a plane parallel to the
image is only scaled and shifted: every row is read in order. The view keeps the full resolution,
each pixel averaged over 2 x 2: a sample at any position has the blur of the halved reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.config import PlaneSweep as Parameters
from airground.core.arrays import F32, F64, I16, I32, U8, U16
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.dense import sweep_kernels as kernels

ROUNDING_PX = 1e-6
"""Distance outside of an image that still counts as its edge [px]: rounding."""
GAIN_BLUR_PX = 21
"""Side of the squares over which brightness is compared [px]."""
GAIN_STRIDE_PX = 6
"""Distance between these squares [px]."""
GAIN_MIN_SAMPLES = 30
"""Least number of overlapping squares that determine a gain; with fewer it stays 1."""


def inverse_depth_planes(near_m: float, far_m: float, count: int) -> F64:
    """(count,) depths [m] from near to far, evenly spaced in inverse depth."""
    if not 0 < near_m < far_m:
        raise ValueError(f"depth range must be 0 < near < far, got {near_m} to {far_m}")
    return 1.0 / np.linspace(1.0 / near_m, 1.0 / far_m, count)


def halved(image: U8) -> F32:
    """The image averaged over 2 x 2 pixels, (height // 2, width // 2)."""
    height, width = (n // 2 * 2 for n in image.shape)
    blocks = image[:height, :width].astype(np.float32)
    return 0.25 * (blocks[::2, ::2] + blocks[1::2, ::2] + blocks[::2, 1::2] + blocks[1::2, 1::2])


@dataclass(frozen=True)
class Gain:
    """Brightness of the reference over that of a view: level + x column + y row.

    The level follows the exposure. Vignetting falls with the square of the distance from
    the middle, so that the ratio of two views shifted against each other is a plane."""

    level: float
    x: float
    y: float


@dataclass(frozen=True)
class TurnedView:
    """A view turned to look the way the reference does.

    Attributes:
        phases: (2, height, 2, width) float32: [row & 1, row >> 1, column & 1, column >> 1]
            of the full-resolution image averaged over 2 x 2. Position u of the halved
            camera is column 2 u.
        valid: (2 * height, 2) int32: columns [lo, hi) of each row that the view covers.
    """

    phases: F32
    valid: I32

    @classmethod
    def turn(cls, image: U8, camera: PinholeCamera, R_view_reference: F64) -> TurnedView:
        """Turns a full-resolution image of `camera`."""
        matrix = camera.matrix()
        homography = matrix @ R_view_reference @ np.linalg.inv(matrix)
        size = (camera.width, camera.height)
        flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
        turned = cv2.warpPerspective(
            image.astype(np.float32), homography, size, flags=flags, borderMode=cv2.BORDER_REPLICATE
        )
        height, width = camera.height // 2, camera.width // 2
        mean = cv2.boxFilter(turned, -1, (2, 2), anchor=(0, 0), borderType=cv2.BORDER_REPLICATE)
        blocks = mean[: 2 * height, : 2 * width].reshape(height, 2, width, 2)
        phases = np.ascontiguousarray(blocks.transpose(1, 0, 3, 2), np.float32)
        return cls(phases, _covered_columns(homography, camera)[: 2 * height])

    def scaled(self, gain: Gain) -> TurnedView:
        """The view as bright as the reference."""
        _, height, _, width = self.phases.shape
        factor = gain.level + gain.x * np.arange(width) + gain.y * np.arange(height)[:, None]
        return TurnedView(self.phases * factor.astype(np.float32)[None, :, None, :], self.valid)


def _covered_columns(homography: F64, camera: PinholeCamera) -> I32:
    """(rows, 2) columns [lo, hi) where the 2 x 2 mean that starts there saw the image only.
    Each border of the image is a linear inequality in x, which gives one end of the row."""
    to_x, to_y, to_z = homography
    inside = np.stack(
        [to_x, (camera.width - 1) * to_z - to_x, to_y, (camera.height - 1) * to_z - to_y, to_z]
    )
    slope = inside[:, :1]
    at_column_0 = inside[:, 1:2] * np.arange(camera.height) + inside[:, 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        end = -at_column_0 / slope
    never = ((slope == 0) & (at_column_0 < 0)).any(axis=0)
    first = np.ceil(np.where(slope > 0, end, 0.0).max(axis=0) - ROUNDING_PX)
    last = np.floor(np.where(slope < 0, end, camera.width - 1.0).min(axis=0) + ROUNDING_PX)
    last[never] = -1
    lo = np.append(np.maximum(first[:-1], first[1:]), 0).clip(0)
    hi = np.append(np.minimum(last[:-1], last[1:]), 0)
    hi[hi <= lo] = 0
    return np.stack([np.where(hi > 0, lo, 0), hi], axis=1).astype(np.int32)


class Workspace:
    """Arrays of uint16 that are free for use: memory that outlives a depth map.
    Allocating and first touching a cost volume of 36 MB takes longer than aggregating it."""

    def __init__(self) -> None:
        self._free: list[U16] = []

    def take(self, shape: tuple[int, ...]) -> U16:
        """A contiguous array with anything in it, not zeros."""
        for index, array in enumerate(self._free):
            if array.size == np.prod(shape):
                return self._free.pop(index).reshape(shape)
        return np.empty(shape, np.uint16)

    def give(self, array: U16) -> None:
        """Hand an array back; it must not be used afterwards."""
        self._free.append(array)


class CostVolume:
    """Photometric errors of one reference view at every pixel and plane, over several views.

    Attributes:
        costs: (height, planes, width) uint16 sums over views in sixteenths of grey levels;
            anything before the first view.
        limits: Columns [lo, hi) that each view covers, (height, planes, 2) int16 per view.
    """

    def __init__(self, costs: U16) -> None:
        self.costs = costs
        self.limits: list[I16] = []


class PlaneSweep:
    """Collects the evidence for the depth of one reference view.

    Args:
        image: (height, width) uint8, the reference at full resolution.
        camera: Camera of the reference at full resolution.
        T_mav_camera: Pose of the reference.
        depths: (planes,) depth hypotheses [m], evenly spaced in inverse depth.
        parameters: The section `plane_sweep` of the configuration.
        sides: Number of cost volumes; 2 keeps views before and after the reference apart, since
            what an edge hides from one side the other side sees.
        workspace: Memory of the cost volumes.
    """

    def __init__(
        self,
        image: U8,
        camera: PinholeCamera,
        T_mav_camera: SE3,
        depths: F64,
        parameters: Parameters,
        sides: int,
        workspace: Workspace | None = None,
    ) -> None:
        self.full_camera = camera
        self.camera = camera.halved()
        self.T_mav_camera = T_mav_camera
        self.depths = depths
        self.parameters = parameters
        self.reference = halved(image)
        self._coarse = _coarse(self.reference)
        shape = (self.camera.height, len(depths), self.camera.width)
        self.workspace = workspace or Workspace()
        self.volumes = [CostVolume(self.workspace.take(shape)) for _ in range(sides)]

    @property
    def views(self) -> int:
        return sum(len(volume.limits) for volume in self.volumes)

    def release(self) -> None:
        """Hand the cost volumes back to the workspace; the sweep is of no use afterwards."""
        for volume in self.volumes:
            self.workspace.give(volume.costs)
        self.volumes = []

    def add(self, image: U8, T_mav_camera: SE3, side: int) -> None:
        """Compares one more view with the reference at every plane."""
        T_reference_view = self.T_mav_camera.inverse() @ T_mav_camera
        view = TurnedView.turn(image, self.full_camera, T_reference_view.rotation.T)
        view = view.scaled(self._gain(view, T_reference_view.translation))
        column_scale, column_shift, row_scale, row_shift = self._plane_maps(
            T_reference_view.translation
        )
        volume = self.volumes[side]
        height, planes, width = volume.costs.shape
        limits = np.empty((height, planes, 2), np.int16)
        kernels.add_view(
            volume.costs,
            not volume.limits,
            limits,
            self.reference,
            view.phases,
            view.valid,
            row_scale,
            row_shift,
            *kernels.plan_columns(column_scale, column_shift, width),
            self.parameters.truncation,
        )
        volume.limits.append(limits)

    def _plane_maps(self, centre: F64) -> tuple[F64, F64, F64, F64]:
        """Scale and shift from reference pixels to the view's half pixels, plane by plane.

        A point at depth z on the ray of column x is at depth z - c_z before the turned view with
        centre c: u = cx + (f (x - cx) z / f - f c_x) / (z - c_z)."""
        camera = self.camera
        scale = self.depths / (self.depths - centre[2])
        x_shift = camera.cx * (1 - scale) - camera.fx * centre[0] / (self.depths - centre[2])
        y_shift = camera.cy * (1 - scale) - camera.fy * centre[1] / (self.depths - centre[2])
        return 2 * scale, 2 * x_shift, 2 * scale, 2 * y_shift

    def _gain(self, view: TurnedView, centre: F64) -> Gain:
        """The view's gain, seen through the middle plane.

        It is the least-squares plane through the ratio of the blurred images, fitted twice: the
        second time without the outliers of the first."""
        middle = len(self.depths) // 2
        column_scale, column_shift, row_scale, row_shift = (
            m[middle] / 2 for m in self._plane_maps(centre)
        )
        matrix = np.array([[column_scale, 0, column_shift], [0, row_scale, row_shift]])
        size = (self.camera.width, self.camera.height)
        flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
        even = np.ascontiguousarray(view.phases[0, :, 0, :])
        moved = cv2.warpAffine(even, matrix, size, flags=flags, borderValue=-1e6)
        blurred, target = _coarse(moved).ravel(), self._coarse.ravel()
        begin, stride = GAIN_BLUR_PX // 2, GAIN_STRIDE_PX
        rows, columns = np.indices(self._coarse.shape).reshape(2, -1) * stride + begin
        terms = np.column_stack([np.ones(len(rows)), columns, rows]) * blurred[:, None]
        good = blurred > 1
        gain = np.array([1.0, 0.0, 0.0])
        for _ in range(2):
            if good.sum() < GAIN_MIN_SAMPLES:
                break
            gain = np.linalg.lstsq(terms[good], target[good], rcond=None)[0]
            off = np.abs(terms @ gain - target)
            good &= off <= 2.5 * np.median(off[good]) + 0.5
        return Gain(*gain)


def _coarse(image: NDArray[Any]) -> NDArray[Any]:
    """Means over squares of the image, a few pixels apart."""
    begin, stride = GAIN_BLUR_PX // 2, GAIN_STRIDE_PX
    return cv2.blur(image, (GAIN_BLUR_PX, GAIN_BLUR_PX))[begin::stride, begin::stride]
