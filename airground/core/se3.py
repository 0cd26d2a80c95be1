"""Rigid motions.

`T_a_b` maps coordinates in frame b to frame a; adjacent letters cancel:
`T_ground_camera = T_ground_mav @ T_mav_camera`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, overload

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from airground.core.arrays import F64, Floats, read_only

FARTHEST_M = 1e9
"""No place is farther from the origin of its frame [m]: its digits would be lost."""
ROTATION_TOLERANCE = 1e-6
_NEWTON = 1.5 * np.eye(3)


@dataclass(frozen=True, eq=False)
class SE3:
    """A rotation followed by a translation: `x_a = rotation @ x_b + translation`.

    Attributes:
        rotation: (3, 3) float64, orthonormal with determinant +1.
        translation: (3,) float64 [m], the origin of b in a.

    Raises:
        ValueError: A shape is wrong, a number is not finite, or the matrix is no rotation.
    """

    rotation: F64
    translation: F64

    def __post_init__(self) -> None:
        rotation = read_only(self.rotation, "rotation", (3, 3), np.float64)
        translation = read_only(self.translation, "translation", (3,), np.float64)
        off, mirrored = _flaws(rotation, translation)
        if not math.isfinite(off):
            raise ValueError("pose is not finite")
        if off > ROTATION_TOLERANCE or mirrored:
            raise ValueError(f"not a rotation matrix (off by {off:.1e})")
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "translation", translation)

    @classmethod
    def identity(cls) -> SE3:
        return cls(np.eye(3), np.zeros(3))

    @classmethod
    def from_matrix(cls, matrix: ArrayLike) -> SE3:
        """From a (4, 4) homogeneous matrix; the rotation is made orthonormal again."""
        matrix = np.asarray(matrix, dtype=np.float64)
        if matrix.shape != (4, 4):
            raise ValueError(f"expected a 4x4 matrix, got {matrix.shape}")
        return cls(nearest_rotation(matrix[:3, :3]), matrix[:3, 3])

    @classmethod
    def from_quaternion_xyzw(cls, quaternion: ArrayLike, translation: ArrayLike) -> SE3:
        """From a quaternion in TUM's order (x, y, z, w); it need not have unit length."""
        rotation = Rotation.from_quat(np.asarray(quaternion, dtype=np.float64))
        return cls(rotation.as_matrix(), np.asarray(translation, dtype=np.float64))

    @classmethod
    def from_rotation_vector(cls, vector: ArrayLike, translation: ArrayLike = (0, 0, 0)) -> SE3:
        """From an axis times angle [rad] and a translation [m]."""
        rotation = Rotation.from_rotvec(np.asarray(vector, dtype=np.float64))
        return cls(rotation.as_matrix(), np.asarray(translation, dtype=np.float64))

    @classmethod
    def from_heading(cls, heading: float, translation: ArrayLike = (0, 0, 0)) -> SE3:
        """A turn by `heading` [rad] about z (counter-clockwise from above), then a shift."""
        return cls.from_rotation_vector((0.0, 0.0, heading), translation)

    def matrix(self) -> F64:
        """The (4, 4) homogeneous matrix."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.rotation
        matrix[:3, 3] = self.translation
        return matrix

    def quaternion_xyzw(self) -> F64:
        """(4,) unit quaternion in TUM's order, with w >= 0."""
        quaternion = Rotation.from_matrix(self.rotation).as_quat()
        result: F64 = -quaternion if quaternion[3] < 0 else quaternion
        return result

    def rotation_vector(self) -> F64:
        """(3,) axis times angle [rad]."""
        result: F64 = Rotation.from_matrix(self.rotation).as_rotvec()
        return result

    def angle(self) -> float:
        """Angle of the rotation [rad], in [0, pi] (angle-axis, as in Fig. 14)."""
        return rotation_angle(self.rotation)

    def heading(self) -> float:
        """Turn about z [rad] that best explains the rotation, in (-pi, pi]."""
        r = self.rotation
        return float(np.arctan2(r[1, 0] - r[0, 1], r[0, 0] + r[1, 1]))

    def inverse(self) -> SE3:
        return SE3(self.rotation.T, -self.rotation.T @ self.translation)

    @overload
    def __matmul__(self, other: SE3) -> SE3: ...
    @overload
    def __matmul__(self, other: Floats) -> F64: ...
    def __matmul__(self, other: SE3 | Floats) -> SE3 | F64:
        """Compose with a motion, or move points of shape (3,) or (N, 3)."""
        if isinstance(other, SE3):
            rotation = self.rotation @ other.rotation
            # One Newton step toward the nearest rotation keeps long chains orthonormal: the
            # error of a product is all but nothing already, and is squared by it.
            rotation = rotation @ (_NEWTON - 0.5 * rotation.T @ rotation)
            return SE3(rotation, self.rotation @ other.translation + self.translation)
        return other @ self.rotation.T + self.translation

    def log(self) -> F64:
        """(6,) twist (rho, phi) [m, rad] with `SE3.exp(T.log()) == T`."""
        phi = self.rotation_vector()
        return np.concatenate([np.linalg.solve(_left_jacobian(phi), self.translation), phi])

    @classmethod
    def exp(cls, twist: ArrayLike) -> SE3:
        """From a (6,) twist (rho, phi) [m, rad]."""
        twist = np.asarray(twist, dtype=np.float64)
        phi = twist[3:]
        return cls.from_rotation_vector(phi, _left_jacobian(phi) @ twist[:3])


@njit(cache=True, nogil=True, error_model="numpy")
def _flaws(rotation: F64, translation: F64) -> tuple[float, bool]:
    """Deviation of R R^T from the identity, NaN for a non-finite number; whether det R < 0."""
    r = rotation
    off, finite = 0.0, True
    for i in range(3):
        finite &= np.isfinite(translation[i])
        for j in range(3):
            finite &= np.isfinite(r[i, j])
            product = r[i, 0] * r[j, 0] + r[i, 1] * r[j, 1] + r[i, 2] * r[j, 2]
            off = max(off, abs(product - (1.0 if i == j else 0.0)))
    determinant = (
        r[0, 0] * (r[1, 1] * r[2, 2] - r[1, 2] * r[2, 1])
        - r[0, 1] * (r[1, 0] * r[2, 2] - r[1, 2] * r[2, 0])
        + r[0, 2] * (r[1, 0] * r[2, 1] - r[1, 1] * r[2, 0])
    )
    return (off if finite else np.nan), determinant < 0


@njit(cache=True, nogil=True, error_model="numpy")
def rotation_angle(rotation: F64) -> float:
    """Angle of a rotation (3, 3) [rad], in [0, pi], exact to rounding everywhere."""
    r = rotation
    x, y, z = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    return math.atan2(math.sqrt(x * x + y * y + z * z), r[0, 0] + r[1, 1] + r[2, 2] - 1.0)


def interpolate(start: SE3, end: SE3, fraction: float) -> SE3:
    """The motion at `fraction` in [0, 1] of the way: straight line, constant turn rate."""
    turn = Rotation.from_matrix(start.rotation.T @ end.rotation).as_rotvec()
    rotation = start.rotation @ Rotation.from_rotvec(fraction * turn).as_matrix()
    translation = (1.0 - fraction) * start.translation + fraction * end.translation
    return SE3(nearest_rotation(rotation), translation)


def nearest_rotation(matrix: NDArray[Any]) -> F64:
    """The rotation closest to `matrix`."""
    u, _, vt = np.linalg.svd(matrix)
    if np.linalg.det(u @ vt) < 0:
        u[:, 2] *= -1
    result: F64 = u @ vt
    return result


def _left_jacobian(phi: F64) -> F64:
    """Left Jacobian of SO(3): couples turning and moving in exp and log."""
    angle = float(np.linalg.norm(phi))
    skew = np.array([[0, -phi[2], phi[1]], [phi[2], 0, -phi[0]], [-phi[1], phi[0], 0]])
    jacobian: F64 = np.eye(3) + 0.5 * skew + skew @ skew / 6.0
    if angle >= 1e-5:
        linear, squared = (1 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
        jacobian = np.eye(3) + linear * skew + squared * skew @ skew
    return jacobian
