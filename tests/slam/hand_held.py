"""A depth camera in a hand that turns on the spot, in the synthetic room.

As a Kinect does: rows are taken one after the other, moving images are smeared, and depth is
taken later than colour. The motion is a sum of sines, with turns of up to 2.1 rad/s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.cloud import Source
from airground.core.messages import GroundImage, ImuSamples, RobotCalibration
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from tests.slam import synthetic_world as world

CAMERA = world.CAMERA
HZ = 30.0
PLACE = np.array([1.3, 0.0, 1.1])
"""Where the hand is, free of boxes [m]."""
AMPLITUDES = np.array([0.07, 0.05, 0.04, 0.18, 0.2, 0.8])
"""Of x, y, z [m] and of roll, pitch, yaw [rad]."""
FREQUENCIES = np.array([0.45, 0.6, 0.8, 0.7, 0.55, 0.37])
PHASES = np.array([0.3, 1.1, 2.0, 0.0, 0.7, 0.2])
GREY_SIGMA, INVERSE_DEPTH_SIGMA = 3.0, 0.003
NO_IMU = ImuSamples(np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3)))


@dataclass(frozen=True)
class Hand:
    """How images come about.

    Attributes:
        readout_s: From the first row to the last, of colour and depth [s].
        exposure_s: For how long each row sees [s].
        depth_later_s: How much later depth is taken than colour [s].
    """

    readout_s: float = 0.026
    exposure_s: float = 0.01
    depth_later_s: float = 0.01


def sequence(seconds: float, hand: Hand, seed: int = 0) -> world.Sequence:
    """Colour, depth and true poses at the middle rows of the colour images."""
    rng = np.random.default_rng(seed)
    stamps = world.START_NS + np.rint(np.arange(round(seconds * HZ)) * 1e9 / HZ).astype(np.int64)
    times = (stamps - world.START_NS) * 1e-9
    calibration = RobotCalibration(
        CAMERA,
        SE3.identity(),
        SE3(world.R_BODY_AHEAD, np.zeros(3)),
        readout_s=hand.readout_s,
    )
    images = tuple(_image(int(s), t, hand, rng) for s, t in zip(stamps, times, strict=True))
    poses = [_pose(t) for t in times]
    truth = Trajectory.from_poses(stamps.tolist(), poses)
    return world.Sequence(Source.GROUND, calibration, images, NO_IMU, truth)


def _pose(t: float) -> SE3:
    """`T_world_camera`."""
    x = AMPLITUDES * np.sin(2 * np.pi * FREQUENCIES * t + PHASES)
    turn = SE3.from_rotation_vector([0, 0, x[5]]) @ SE3.from_rotation_vector([x[3], x[4], 0])
    return SE3(turn.rotation @ world.R_PITCH @ world.R_BODY_AHEAD, PLACE + x[:3])


def _image(stamp_ns: int, t: float, hand: Hand, rng: np.random.Generator) -> GroundImage:
    exposures = [_cast(t + share * hand.exposure_s, hand.readout_s) for share in (-0.5, 0, 0.5)]
    grey = np.mean([grey for grey, _, _ in exposures], axis=0)
    grey = grey + rng.normal(0, GREY_SIGMA, grey.shape)
    tints = exposures[1][2]
    colour = np.rint(grey[..., None] * tints).clip(0, 255).astype(np.uint8)
    _, depth, _ = _cast(t + hand.depth_later_s, hand.readout_s)
    depth = 1.0 / (1.0 / depth + rng.normal(0, INVERSE_DEPTH_SIGMA, depth.shape))
    depth = np.where(depth < world.MAX_DEPTH_M, depth, np.nan).astype(np.float32)
    return GroundImage(stamp_ns, colour, depth)


def _cast(t: float, readout_s: float) -> tuple[NDArray, NDArray, NDArray]:
    """Grey levels, depth [m] and tints of an image whose middle row is taken at `t` [s]."""
    boxes, tints = world._room()
    times = t + ((np.arange(CAMERA.height) + 0.5) / CAMERA.height - 0.5) * readout_s
    rotations = np.array([_pose(time).rotation for time in times])
    rays = np.einsum("hij,hwj->hwi", rotations, CAMERA.rays())
    flat = np.ascontiguousarray(rays.reshape(-1, 3))
    depth, box, grey = world._cast(flat, _pose(t).translation, boxes, world._texture())
    shape = (CAMERA.height, CAMERA.width)
    return grey.reshape(shape), depth.reshape(shape), tints[box].reshape(*shape, 3)
