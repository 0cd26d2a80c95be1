"""The normal equations against a twin that differentiates plain residuals numerically."""

from dataclasses import replace

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.slam import so3
from airground.slam.bundle_adjustment import Observations, Role, Settings
from airground.slam.bundle_adjustment import solver as bundle_solver
from airground.slam.bundle_adjustment.inertial_residuals import INTEGRATION_NOISE
from airground.slam.bundle_adjustment.priors import GAUGE_SIGMA
from airground.slam.bundle_adjustment.residuals import BEHIND_SIGMAS, MIN_DEPTH
from tests.slam import bundle_problems as made

pytestmark = pytest.mark.kernel

SETTINGS = Settings()
STEP = 1e-6


class Twin:
    """All whitened residuals of a problem, one block after the other, and their Jacobian.

    Unknowns: poses of the moving keyframes, then their velocities and biases, then points.
    """

    def __init__(self, problem, roles, states, points):
        self.problem, self.roles = problem, roles
        self.states, self.points = states, points
        self.moving = np.flatnonzero(roles != Role.FIXED)
        self.inertial = bool(problem.inertial)
        self.keyframe_unknowns = len(self.moving) * (15 if self.inertial else 6)
        self.unknowns = self.keyframe_unknowns + points.size

    def residuals(self, step):
        """(R, ) residuals and, for each, the number of its robust block (-1 for none)."""
        vectors, rotations, points = self._moved(step)
        out, blocks = [], []
        o = self.problem.observations
        for m in range(len(o)):
            k = o.keyframes[m]
            pose = SE3(so3_clean(rotations[k]), vectors[k, 0:3]) @ made.T_RIG_CAMERA
            x = pose.inverse() @ points[o.points[m]]
            depth_known = np.isfinite(o.inverse_depths[m])
            if x[2] <= MIN_DEPTH:
                continue
            out.extend((made.CAMERA.project(x[None])[0] - o.pixels[m]) / o.sigmas_px[m])
            blocks.extend([2 * m, 2 * m])
            if depth_known:
                out.append((1.0 / x[2] - o.inverse_depths[m]) / o.inverse_depth_sigmas[m])
                blocks.append(2 * m + 1)
        rest = self._motions(rotations, vectors) + self._priors(rotations, vectors)
        return np.array(out + rest), np.array(blocks + [-1] * len(rest), int)

    def _moved(self, step):
        s = self.states
        vectors = np.hstack([s.positions, s.velocities, s.gyro_biases, s.accelerometer_biases])
        rotations = s.rotations.copy()
        count = len(self.moving)
        for n, k in enumerate(self.moving):
            # The convention between rooms: turned on the right, in the rig.
            turn = rotations[k].T @ step[6 * n : 6 * n + 3]
            rotations[k] = rotations[k] @ so3.exp(turn)
            vectors[k, 0:3] += step[6 * n + 3 : 6 * n + 6]
            if self.inertial:
                vectors[k, 3:12] += step[6 * count + 9 * n : 6 * count + 9 * n + 9]
        return vectors, rotations, self.points + step[self.keyframe_unknowns :].reshape(-1, 3)

    def _motions(self, rotations, vectors):
        out = []
        for factor in self.problem.inertial:
            motion = factor.preintegration
            i, j = factor.first, factor.second
            if self.roles[i] == self.roles[j] == Role.FIXED:
                continue
            R, p, v = motion.predict(rotations[i], *np.split(vectors[i], 4))
            back = rotations[i].T
            error = np.concatenate(
                [
                    so3.log(R.T @ rotations[j]),
                    back @ (vectors[j, 3:6] - v),
                    back @ (vectors[j, 0:3] - p),
                ]
            )
            covariance = motion.covariance * (1.0 + INTEGRATION_NOISE * np.eye(9))
            out.extend(np.linalg.solve(np.linalg.cholesky(covariance), error))
            walk = vectors[j, 6:12] - vectors[i, 6:12]
            out.extend(walk[:3] / motion.gyro_bias_sigma)
            out.extend(walk[3:] / motion.accelerometer_bias_sigma)
        return out

    def _priors(self, rotations, vectors):
        out = []
        for k in self.moving:
            if self.roles[k] == Role.GAUGE:
                turn = so3.log(rotations[k] @ self.states.rotations[k].T)
                moved = vectors[k, 0:3] - self.states.positions[k]
                out.extend(np.append(moved, turn[2]) / GAUGE_SIGMA)
            if self.states.still is not None and self.states.still[k] and self.inertial:
                out.extend(vectors[k, 3:6] / SETTINGS.still_sigma)
            if self.inertial and k == 0:
                out.extend(vectors[k, 6:9] / SETTINGS.gyro_bias_prior_sigma)
                out.extend(vectors[k, 9:12] / SETTINGS.accelerometer_bias_prior_sigma)
        return out

    def cost_and_weights(self, residuals, blocks):
        cost, weights = 0.5 * np.sum(residuals[blocks < 0] ** 2), np.ones(len(residuals))
        for block in np.unique(blocks[blocks >= 0]):
            norm = np.linalg.norm(residuals[blocks == block])
            k = SETTINGS.huber
            weights[blocks == block] = min(1.0, k / norm)
            cost += 0.5 * norm**2 if norm <= k else k * norm - 0.5 * k**2
        return cost, weights

    def normal_equations(self):
        zero = np.zeros(self.unknowns)
        residuals, blocks = self.residuals(zero)
        jacobian = np.empty((len(residuals), self.unknowns))
        for n in range(self.unknowns):
            step = zero.copy()
            step[n] = STEP
            ahead, back = self.residuals(step)[0], self.residuals(-step)[0]
            jacobian[:, n] = (ahead - back) / (2 * STEP)
        cost, weights = self.cost_and_weights(residuals, blocks)
        weighted = jacobian * weights[:, None]
        return cost, weighted.T @ jacobian, weighted.T @ residuals


def dense(equations):
    """The whole Hessian from its upper triangle, its chain and what couples them."""
    width, count = len(equations.poses), len(equations.chain)
    full = np.zeros((width + 9 * count, width + 9 * count))
    full[:width, :width] = np.triu(equations.poses)
    for k in range(count):
        row = width + 9 * k
        full[row : row + 9, row : row + 9] = np.triu(equations.chain[k])
        if k + 1 < count:
            full[row : row + 9, row + 9 : row + 18] = equations.links[k]
        for n, pose in enumerate(range(k - 1, k + 2)):
            if 0 <= pose < count:
                block = equations.coupling[k][:, 6 * n : 6 * n + 6]
                full[6 * pose : 6 * pose + 6, row : row + 9] = block.T
    return full + np.triu(full, 1).T


def so3_clean(matrix):
    u, _, vt = np.linalg.svd(matrix)
    return u @ vt


def case(name):
    """A small problem, roles, and a start beside the truth with some gross errors."""
    problem = made.make(4, 14, 9, depth=name != "monocular", inertial="imu" in name, seed=3)
    roles = made.fixed(problem.states, 2)
    if name == "imu, gauge, still":
        roles[:] = (Role.GAUGE, Role.FREE, Role.FREE, Role.FREE)
    states, points = made.perturbed(problem, roles)
    if "still" in name:
        still = np.array([False, True, False, True])
        states = replace(states, still=still)
    pixels = problem.observations.pixels.copy()
    pixels[::7] += 40.0
    observations = replace(problem.observations, pixels=pixels)
    # A point seen once is left out on purpose, where damping would let it in.
    twice = np.bincount(observations.points)[observations.points] > 1
    observations = Observations(**{name: a[twice] for name, a in vars(observations).items()})
    if name == "behind":
        points[observations.points[0], 2] = 5.0
    return replace(problem, observations=observations), (roles, states, points)


@pytest.mark.parametrize(
    "name", ["monocular", "depth", "behind", "imu, fixed", "imu, gauge, still"]
)
def test_normal_equations_and_step_equal_the_numerical_ones(name):
    problem, (roles, states, points) = case(name)
    twin = Twin(problem, roles, states, points)
    expected_cost, full, gradient = twin.normal_equations()
    model, start = bundle_solver.prepare(
        states,
        roles,
        points,
        problem.observations,
        problem.inertial,
        made.CAMERA,
        made.T_RIG_CAMERA,
        SETTINGS,
    )
    linear = model.linearize(start)
    n = twin.keyframe_unknowns
    if name == "behind":
        behind = SETTINGS.huber * (BEHIND_SIGMAS - 0.5 * SETTINGS.huber)
        lost = int(np.isnan(model_residuals(problem, states, points)).sum())
        assert lost > 0
        expected_cost += lost * behind
    assert linear.cost == pytest.approx(expected_cost, rel=1e-9)

    damping = 1e-3
    observed = np.diag(full) > 0
    full += damping * np.diag(np.diag(full)) + np.diag(~observed * 1.0)
    equations = model.normal_equations(linear, damping)
    points_block = full[n:, n:]
    reduced = full[:n, :n] - full[:n, n:] @ np.linalg.solve(points_block, full[n:, :n])
    toward = gradient[:n] - full[:n, n:] @ np.linalg.solve(points_block, gradient[n:])
    ours = dense(equations)
    ours += damping * np.diag(equations.diagonal)
    scale = np.sqrt(np.outer(np.diag(full)[:n], np.diag(full)[:n]))
    np.testing.assert_allclose(ours / scale, reduced / scale, atol=2e-6)
    size = np.abs(gradient[:n]).max()
    np.testing.assert_allclose(equations.gradient, toward, atol=2e-6 * size)

    step = -np.linalg.solve(full, gradient)
    ours = bundle_solver.solve(equations, damping)
    np.testing.assert_allclose(ours, step[:n], atol=1e-6)
    moved = model.moved(start, linear, damping, step[:n])
    np.testing.assert_allclose(moved.points.ravel(), twin._moved(step)[2].ravel(), atol=1e-5)
    np.testing.assert_allclose(moved.rotations, twin._moved(step)[1], atol=1e-9)
    np.testing.assert_allclose(moved.vectors, twin._moved(step)[0], atol=1e-12)


def model_residuals(problem, states, points):
    """Of each observation: its depth in the camera, NaN behind."""
    o = problem.observations
    depths = np.empty(len(o))
    for m in range(len(o)):
        k = o.keyframes[m]
        pose = SE3(states.rotations[k], states.positions[k]) @ made.T_RIG_CAMERA
        depths[m] = (pose.inverse() @ points[o.points[m]])[2]
    return np.where(depths > MIN_DEPTH, depths, np.nan)
