"""Elimination of the points from the normal equations, and back again.

Triggs, McLauchlan, Hartley and Fitzgibbon, "Bundle adjustment, a modern synthesis", 1999,
Section 6.1, with the Jacobians factored as in `residuals`.
"""

from __future__ import annotations

from numba import njit

from airground.core.arrays import F64, I64
from airground.slam.bundle_adjustment.residuals import FASTMATH, Triple

FLOOR = 1e-10
"""Least damping of a point, as a share of the trace of its block: a single ray, or rays that
are all but parallel, leave the depth open, and to any other point this is as good as nothing."""


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def _point_block(
    linear: F64, start: int, stop: int, damping: float
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Inverse of a point's damped block (xx, xy, xz, yy, yz, zz) and its gradient."""
    xx = xy = xz = yy = yz = zz = g0 = g1 = g2 = 0.0
    for m in range(start, stop):
        row = linear[m]
        xx += row[0]
        xy += row[1]
        xz += row[2]
        yy += row[3]
        yz += row[4]
        zz += row[5]
        g0 += row[6]
        g1 += row[7]
        g2 += row[8]
    floor = FLOOR * (xx + yy + zz)
    if floor <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    xx += damping * xx + floor
    yy += damping * yy + floor
    zz += damping * zz + floor
    i00, i01, i02 = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    inverse = 1.0 / (xx * i00 + xy * i01 + xz * i02)
    i11, i12, i22 = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    return (
        i00 * inverse,
        i01 * inverse,
        i02 * inverse,
        i11 * inverse,
        i12 * inverse,
        i22 * inverse,
        g0,
        g1,
        g2,
    )


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def _cross(a0: float, a1: float, a2: float, b0: float, b1: float, b2: float) -> Triple:
    return a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def _times_symmetric(v0: float, v1: float, v2: float, row: F64 | tuple[float, ...]) -> Triple:
    """v' B for the symmetric B (xx, xy, xz, yy, yz, zz) that begins `row`."""
    return (
        v0 * row[0] + v1 * row[1] + v2 * row[2],
        v0 * row[1] + v1 * row[3] + v2 * row[4],
        v0 * row[2] + v1 * row[4] + v2 * row[5],
    )


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def _add_block(hessian: F64, r: int, c: int, m: tuple[float, ...], d: Triple, e: Triple) -> None:
    """Add G_d' M G_e, with G_d = [hat(d), -I], at row r and column c."""
    m00, m01, m02, m10, m11, m12, m20, m21, m22 = m
    d0, d1, d2 = d
    e0, e1, e2 = e
    p00, p01, p02 = _cross(m00, m01, m02, e0, e1, e2)
    p10, p11, p12 = _cross(m10, m11, m12, e0, e1, e2)
    p20, p21, p22 = _cross(m20, m21, m22, e0, e1, e2)
    q00, q10, q20 = _cross(d0, d1, d2, p00, p10, p20)
    q01, q11, q21 = _cross(d0, d1, d2, p01, p11, p21)
    q02, q12, q22 = _cross(d0, d1, d2, p02, p12, p22)
    s00, s10, s20 = _cross(d0, d1, d2, m00, m10, m20)
    s01, s11, s21 = _cross(d0, d1, d2, m01, m11, m21)
    s02, s12, s22 = _cross(d0, d1, d2, m02, m12, m22)
    rows = hessian[r : r + 6, c : c + 6]
    _add_row(rows[0], -q00, -q01, -q02, s00, s01, s02)
    _add_row(rows[1], -q10, -q11, -q12, s10, s11, s12)
    _add_row(rows[2], -q20, -q21, -q22, s20, s21, s22)
    _add_row(rows[3], -p00, -p01, -p02, m00, m01, m02)
    _add_row(rows[4], -p10, -p11, -p12, m10, m11, m12)
    _add_row(rows[5], -p20, -p21, -p22, m20, m21, m22)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def _add_row(row: F64, v0: float, v1: float, v2: float, v3: float, v4: float, v5: float) -> None:
    row[0] += v0
    row[1] += v1
    row[2] += v2
    row[3] += v3
    row[4] += v4
    row[5] += v5


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def _add_diagonal(diagonal: F64, s: int, row: F64) -> None:
    """The diagonal of G' B G before any point is eliminated: what damping scales with."""
    d0, d1, d2 = row[9], row[10], row[11]
    diagonal[s] += row[3] * d2 * d2 - 2.0 * row[4] * d1 * d2 + row[5] * d1 * d1
    diagonal[s + 1] += row[0] * d2 * d2 - 2.0 * row[2] * d0 * d2 + row[5] * d0 * d0
    diagonal[s + 2] += row[0] * d1 * d1 - 2.0 * row[1] * d0 * d1 + row[3] * d0 * d0
    diagonal[s + 3] += row[0]
    diagonal[s + 4] += row[3]
    diagonal[s + 5] += row[5]


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def eliminate_points(
    linear: F64, starts: I64, slots: I64, damping: float, hessian: F64, gradient: F64, diagonal: F64
) -> None:
    """Add what the observations say about the poses, their points eliminated.

    Args:
        linear: (M, NUMBERS) result of `residuals.linearize`, sorted by point, then by slot.
        starts: (P + 1,) first observation of each point.
        slots: (M,) number of the moving keyframe; -1 for one that does not move.
        damping: Levenberg-Marquardt's, times the diagonal of each point's block.
        hessian: (N, N) matrix whose upper triangle is added to; pose s begins at 6 s.
        gradient, diagonal: (N,) vectors, added to; the diagonal is that before elimination.
    """
    for j in range(len(starts) - 1):
        start, stop = starts[j], starts[j + 1]
        # Seen once, a point can follow its keyframe anywhere: no information on poses.
        if stop - start < 2:
            continue
        # Sorted by slot: keyframes that do not move come first.
        first = start
        while first < stop and slots[first] < 0:
            first += 1
        if first == stop:
            continue
        i00, i01, i02, i11, i12, i22, g0, g1, g2 = _point_block(linear, start, stop, damping)
        inverse = (i00, i01, i02, i11, i12, i22)
        for a in range(first, stop):
            one = linear[a]
            s = 6 * slots[a]
            d = (one[9], one[10], one[11])
            _add_diagonal(diagonal, s, one)
            b0, b1, b2, b3, b4, b5 = one[0], one[1], one[2], one[3], one[4], one[5]
            # Y = B times the inverse, row by row.
            y00, y01, y02 = _times_symmetric(b0, b1, b2, inverse)
            y10, y11, y12 = _times_symmetric(b1, b3, b4, inverse)
            y20, y21, y22 = _times_symmetric(b2, b4, b5, inverse)
            h0 = one[6] - (y00 * g0 + y01 * g1 + y02 * g2)
            h1 = one[7] - (y10 * g0 + y11 * g1 + y12 * g2)
            h2 = one[8] - (y20 * g0 + y21 * g1 + y22 * g2)
            t0, t1, t2 = _cross(h0, h1, h2, d[0], d[1], d[2])
            _add_row(gradient[s : s + 6], t0, t1, t2, -h0, -h1, -h2)
            for b in range(a, stop):
                other = linear[b]
                m00, m01, m02 = _times_symmetric(-y00, -y01, -y02, other)
                m10, m11, m12 = _times_symmetric(-y10, -y11, -y12, other)
                m20, m21, m22 = _times_symmetric(-y20, -y21, -y22, other)
                if a == b:
                    m00, m01, m02 = m00 + b0, m01 + b1, m02 + b2
                    m10, m11, m12 = m10 + b1, m11 + b3, m12 + b4
                    m20, m21, m22 = m20 + b2, m21 + b4, m22 + b5
                block = (m00, m01, m02, m10, m11, m12, m20, m21, m22)
                _add_block(hessian, s, 6 * slots[b], block, d, (other[9], other[10], other[11]))


@njit(cache=True, nogil=True, error_model="numpy", fastmath=FASTMATH)
def move_points(
    linear: F64, starts: I64, slots: I64, damping: float, step: F64, points: F64, moved: F64
) -> None:
    """Points (P, 3) [m] after the keyframes took `step` (N,), into `moved`."""
    for j in range(len(starts) - 1):
        start, stop = starts[j], starts[j + 1]
        i00, i01, i02, i11, i12, i22, g0, g1, g2 = _point_block(linear, start, stop, damping)
        for m in range(start, stop):
            if slots[m] < 0:
                continue
            row = linear[m]
            s = 6 * slots[m]
            c0, c1, c2 = _cross(row[9], row[10], row[11], step[s], step[s + 1], step[s + 2])
            c0 -= step[s + 3]
            c1 -= step[s + 4]
            c2 -= step[s + 5]
            t0, t1, t2 = _times_symmetric(c0, c1, c2, row)
            g0 += t0
            g1 += t1
            g2 += t2
        moved[j, 0] = points[j, 0] - (i00 * g0 + i01 * g1 + i02 * g2)
        moved[j, 1] = points[j, 1] - (i01 * g0 + i11 * g1 + i12 * g2)
        moved[j, 2] = points[j, 2] - (i02 * g0 + i12 * g1 + i22 * g2)
