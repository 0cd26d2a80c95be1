"""Metric scale by a Kalman filter beside the visual tracking (Sec. IV).

The paper gives its filter to Weiss and Siegwart, "Real-time metric state estimation for
modular vision-inertial systems", ICRA 2011. As there, vision gives poses and the IMU drives
the prediction. Here the state is in visual units, where vision is right: were positions
metric and measured as (1 / scale) times that, the product of two unknowns would draw the
scale away (up to -37 %). The state holds the inverse of the scale, and bias and tilt times
it: in these the motion is linear, so that no first guess of the scale is needed. The unknowns are
those of the closed form (Kneip, Martinelli and Siegwart, "Closed-form solution for absolute scale
velocity determination combining inertial measurements and a single feature correspondence", ICRA
2011), solved image by image.
"""

from __future__ import annotations

import numpy as np

from airground.core.arrays import F64
from airground.core.messages import USUAL_BIAS_MPS2
from airground.core.se3 import SE3
from airground.slam import so3
from airground.slam.inertial.alignment import OBSERVABLE_SIGMA, VisualNoise
from airground.slam.inertial.alignment_start import tangent_basis
from airground.slam.inertial.preintegration import GRAVITY, Preintegration

POSITION, VELOCITY, BIAS = slice(0, 3), slice(3, 6), slice(6, 9)
UNIT, TILTS, SIZE = 9, slice(10, 12), 12
UNIT_SIGMA = 5.0
"""Prior of the unit as a share of the guess: it may be anything."""
SPEED_SIGMA = 5.0
"""Prior of each axis of the velocity [m/s]."""
TILT_SIGMA = 0.2
"""Prior of gravity's direction from one specific force: robots push with 2 m/s^2 [rad]."""
SURE_SIGMA = 0.2
"""Scale must be known to this share before gravity's direction is worth correcting."""
SCALE_WALK = 0.01
"""A visual map's scale drifts [1/sqrt(s)]. It also makes up for what the filter believes too
easily: the accelerometer's noise drives it, and seems to be motion that shows the scale."""
ROTATION_GAIN = 0.1
"""Share of vision in the rotation, the rest is the gyro's: turned by vision alone, gravity
shakes with the visual noise, and a hovering robot seems to move."""
MEMORY = 100
"""Innovations of so many images tell whether the noise is the stated one."""


class ScaleFilter:
    """Scale and gravity of a visual map, image by image; noise is independent between images.

    Args:
        T_rig_camera: Place of the camera in the rig.
        guess: Metres in a visual unit, for the priors alone. One that is too large makes them too
            narrow, and the scale seems to be known before it is.
    """

    def __init__(self, T_rig_camera: SE3, guess: float = 1.0) -> None:
        self._lever = T_rig_camera.translation
        self._mean = np.zeros(SIZE)
        self._mean[UNIT] = 1.0 / guess
        sigmas = np.empty(SIZE)
        sigmas[POSITION], sigmas[VELOCITY] = SPEED_SIGMA, SPEED_SIGMA
        sigmas[BIAS], sigmas[TILTS] = USUAL_BIAS_MPS2, TILT_SIGMA
        sigmas[UNIT] = UNIT_SIGMA
        self._covariance = np.diag((sigmas / guess) ** 2)
        self._gravity: F64 | None = None
        self._rotation: F64 | None = None
        self._images = 0
        self._anchored = False
        self._surprise = 1.0

    @property
    def scale(self) -> float:
        """Metres in a visual unit; NaN while not even its sign is known."""
        unit = float(self._mean[UNIT])
        return 1.0 / unit if unit > 0.0 and self._gravity is not None else np.nan

    @property
    def sigma(self) -> float:
        """Standard deviation of the scale, as a share; infinite while it is not known."""
        sigma = float(np.sqrt(self._covariance[UNIT, UNIT])) * self.scale
        # Where vision errs more than it was said to, so does the scale.
        return sigma * max(1.0, self._surprise**0.5) if np.isfinite(sigma) else np.inf

    @property
    def observable(self) -> bool:
        """Whether the motion so far shows the scale to 5 %."""
        return self.sigma < OBSERVABLE_SIGMA

    @property
    def gravity(self) -> F64 | None:
        """(3,) in the visual map's axes [m/s^2]; None before the first inertial motion."""
        return self._gravity

    @property
    def accelerometer_bias(self) -> F64:
        """(3,) bias of the accelerometer [m/s^2]; NaN while the scale is unknown."""
        bias: F64 = self._mean[BIAS] * self.scale
        return bias

    def add(
        self, rotation: F64, centre: F64, noise: VisualNoise, motion: Preintegration | None
    ) -> None:
        """Take in one image.

        Args:
            rotation: (3, 3) visual rotation `R_v_rig`.
            centre: (3,) centre of the camera in the visual map.
            noise: Noise of the two; that of the centre grows with the depth of the scene.
            motion: Inertial motion since the previous image; None for the first image, and where
                tracking or samples were lost in between.
        """
        if motion is not None and self._rotation is not None:
            self._predict(self._rotation, noise, motion)
            turned = self._rotation @ motion.rotation
            self._images += 1
            share = max(ROTATION_GAIN, 1.0 / self._images)
            self._rotation = turned @ so3.exp(share * so3.log(turned.T @ rotation))
        else:
            self._forget_motion(centre)
            self._rotation, self._images = np.array(rotation), 1
        self._update(self._rotation, centre, noise)
        if not self._anchored and self.sigma < SURE_SIGMA:
            self._anchor_bias()
        self._turn_gravity()

    def follow(self, scale: float, rotation: F64, before: F64, after: F64) -> None:
        """The map was scaled and turned: x became scale * rotation @ (x - before) + after."""
        change = scale * np.eye(SIZE)
        for part in (POSITION, VELOCITY):
            change[part, part] = scale * rotation
        shift = np.zeros(SIZE)
        shift[POSITION] = after - scale * rotation @ before
        if self._gravity is not None:
            turned = rotation @ self._gravity
            change[TILTS, TILTS] = (
                scale * tangent_basis(turned).T @ rotation @ tangent_basis(self._gravity)
            )
            self._gravity = turned
        if self._rotation is not None:
            self._rotation = rotation @ self._rotation
        self._mean = change @ self._mean + shift
        self._covariance = change @ self._covariance @ change.T

    def _forget_motion(self, centre: F64) -> None:
        """The robot may be anywhere, at any speed."""
        unit = abs(self._mean[UNIT])
        self._covariance[:6], self._covariance[:, :6] = 0.0, 0.0
        self._covariance[range(6), range(6)] = (SPEED_SIGMA * unit) ** 2
        self._mean[POSITION], self._mean[VELOCITY] = centre, 0.0

    def _predict(self, R: F64, visual: VisualNoise, motion: Preintegration) -> None:
        """Move on by one inertial motion that began at rotation R."""
        t = motion.duration_s
        by_bias = motion.velocity_by_accelerometer_bias, motion.position_by_accelerometer_bias
        # The bias of the state counts from zero, not from where the motion was linearized.
        sped = R @ (motion.velocity - by_bias[0] @ motion.accelerometer_bias)
        moved = R @ (motion.position - by_bias[1] @ motion.accelerometer_bias)
        if self._gravity is None:
            self._gravity = -GRAVITY * sped / np.linalg.norm(sped)
        tilts = -so3.hat(self._gravity) @ tangent_basis(self._gravity)
        F = np.eye(SIZE)
        F[POSITION, VELOCITY] = t * np.eye(3)
        F[POSITION, BIAS], F[VELOCITY, BIAS] = R @ by_bias[1], R @ by_bias[0]
        F[POSITION, UNIT] = moved + 0.5 * t * t * self._gravity
        F[VELOCITY, UNIT] = sped + t * self._gravity
        F[POSITION, TILTS], F[VELOCITY, TILTS] = 0.5 * t * t * tilts, t * tilts

        # White noise of the samples, and the visual rotation that turns them; in metres.
        noise = np.zeros((SIZE, SIZE))
        order = np.r_[6:9, 3:6]
        turn = np.zeros((6, 6))
        turn[:3, :3] = turn[3:, 3:] = R
        swing = np.concatenate([so3.hat(moved), so3.hat(sped)])
        noise[:6, :6] = turn @ motion.covariance[np.ix_(order, order)] @ turn.T
        noise[:6, :6] += visual.rotation_sigma**2 * swing @ swing.T
        noise[UNIT, UNIT] = SCALE_WALK**2 * t
        noise[BIAS, BIAS] = motion.accelerometer_bias_sigma**2 * np.eye(3)
        self._mean = F @ self._mean
        # The unit's expected square: while it is open, its mean may be near zero by chance.
        square = self._mean[UNIT] ** 2 + self._covariance[UNIT, UNIT]
        self._covariance = F @ self._covariance @ F.T + square * noise

    def _update(self, rotation: F64, centre: F64, noise: VisualNoise) -> None:
        """Take in where the camera is."""
        H = np.zeros((3, SIZE))
        H[:, POSITION] = np.eye(3)
        H[:, UNIT] = rotation @ self._lever
        surprise = self._measure(H, centre, noise.position_sigma)
        self._surprise += (surprise - self._surprise) / MEMORY

    def _anchor_bias(self) -> None:
        """Say again how large the bias may be, now that the unit it was said in is known."""
        H = np.zeros((3, SIZE))
        H[:, BIAS] = np.eye(3)
        self._measure(H, np.zeros(3), USUAL_BIAS_MPS2 * self._mean[UNIT])
        self._anchored = True

    def _measure(self, H: F64, value: F64, sigma: float) -> float:
        """Take in three numbers; returns their normalized innovation squared, by three."""
        white = sigma**2 * np.eye(3)
        innovation = value - H @ self._mean
        S = H @ self._covariance @ H.T + white
        gain = np.linalg.solve(S, H @ self._covariance).T
        self._mean = self._mean + gain @ innovation
        keep = np.eye(SIZE) - gain @ H
        self._covariance = keep @ self._covariance @ keep.T + gain @ white @ gain.T
        return float(innovation @ np.linalg.solve(S, innovation)) / 3.0

    def _turn_gravity(self) -> None:
        """Put the tilt that was found into gravity's direction, so that it stays small."""
        if self._gravity is None or not self.sigma < SURE_SIGMA:
            return
        basis = tangent_basis(self._gravity)
        tilt = self._mean[TILTS] / self._mean[UNIT]
        turned = so3.exp(basis @ tilt) @ self._gravity
        # Tilts are measured along the new direction's own axes, and from it.
        change = np.eye(SIZE)
        change[TILTS, TILTS] = tangent_basis(turned).T @ basis
        change[TILTS, UNIT] = -change[TILTS, TILTS] @ tilt
        self._mean = change @ self._mean
        self._covariance = change @ self._covariance @ change.T
        self._gravity = turned * (GRAVITY / np.linalg.norm(turned))
