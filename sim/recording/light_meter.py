"""Automatic exposure of a recording: small pictures along the motion are metered before its images
are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.io.lens import Lens
from sim.recording.bodies_in_view import BodiesInView
from sim.recording.exposure_truth import write_exposure
from sim.recording.frames import FramePlan, WorldFiles
from sim.recording.render import Renderer
from sim.robots.motion import Motion, Robot
from sim.robots.moving_bodies import MovingBody, read_bodies
from sim.sensors.auto_exposure import ExposureCourse, regulate

WIDTH_PX = 80
EVERY = 3
"""Of so many images one is metered, 10 a second; between them light changes evenly."""
MAX_HALF_TAN = 1.2
"""Tangent of the widest half angle that is metered, 50 deg: a fisheye's rim hardly counts."""
_SPREAD = 0.33
"""Deviation of the weight, in widths and heights: 0.3 at the sides, 0.1 in the corners."""


def meter_name(robot: Robot) -> str:
    """Name of a robot's metering camera among those of a world."""
    return f"{robot}/meter"


def meter_camera(lens: Lens) -> PinholeCamera:
    """A small pinhole camera over the middle of what a camera sees, without its distortion."""
    fx, fy, _, _ = lens.intrinsics
    across = min(lens.width / 2 / fx, MAX_HALF_TAN)
    down = min(lens.height / 2 / fy, MAX_HALF_TAN)
    height_px = max(round(WIDTH_PX * down / across), 2)
    focal_px = WIDTH_PX / 2 / across
    middle = (WIDTH_PX - 1) / 2, (height_px - 1) / 2
    return PinholeCamera(WIDTH_PX, height_px, focal_px, focal_px, *middle)


def with_exposure(plan: FramePlan) -> FramePlan:
    """The plan with the course of automatic exposure, which the truth gets, too; the same plan if
    exposure is fixed. It needs the files of the worlds."""
    auto, image = plan.preset.exposure, plan.preset.image
    if auto is None or image is None:
        return plan
    courses: dict[Robot, ExposureCourse] = {}
    with _LightMeter(plan) as meter:
        for robot in plan.frames:
            times_ns = _image_times(plan, robot)
            every = times_ns[[*range(0, len(times_ns) - 1, EVERY), len(times_ns) - 1]]
            metered = np.array([meter.histogram(robot, int(time_ns)) for time_ns in every])
            courses[robot] = regulate(
                auto,
                image.exposure_s,
                plan.preset.camera_hz,
                times_ns,
                _between(times_ns, every, metered),
            )
    plan = replace(plan, exposures=courses)
    write_exposure(plan.recording, plan.exposures_of_images())
    return plan


def _image_times(plan: FramePlan, robot: Robot) -> NDArray[np.int64]:
    """(N,) times at the camera's rate from the first image that is taken to the last [ns]."""
    table = plan.true.mav if robot == "mav" else plan.true.ground
    taken = plan.taken_ns[robot] + table.camera.time_offset_ns
    period_ns = 1e9 / plan.preset.camera_hz
    count = round(float(taken[-1] - taken[0]) / period_ns) + 1
    return np.asarray(taken[0] + np.rint(np.arange(count) * period_ns).astype(np.int64))


def _between(
    times_ns: NDArray[np.int64], every: NDArray[np.int64], metered: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(N, 256) histograms at times (N,), linear between those (M, 256) at `every` (M,)."""
    place = np.interp(times_ns, every, np.arange(len(every)))
    before = np.minimum(place.astype(np.int64), max(len(every) - 2, 0))
    after = np.minimum(before + 1, len(every) - 1)
    share = (place - before)[:, None]
    return np.asarray((1 - share) * metered[before] + share * metered[after])


class _LightMeter:
    """Draws and meters small pictures in the light that the robots see; a context manager."""

    def __init__(self, plan: FramePlan) -> None:
        self._plan = plan
        self._motion = Motion.load(plan.motion)
        self._bodies: tuple[MovingBody, ...] = read_bodies(plan.motion.parent)
        self._stack = ExitStack()
        self._renderers: Mapping[WorldFiles, Renderer] = {}
        self._cameras = {
            "mav": meter_camera(plan.true.mav.camera.lens()),
            "ground": meter_camera(plan.true.ground.camera.lens()),
        }
        self._weights = {robot: _weights(camera) for robot, camera in self._cameras.items()}

    def __enter__(self) -> _LightMeter:
        with ExitStack() as opened:
            self._renderers = {
                files: opened.enter_context(
                    Renderer(mujoco.MjModel.from_binary_path(str(files.model)))
                )
                for files in sorted(self._plan.world_files(), key=lambda files: str(files.model))
            }
            self._stack = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def histogram(self, robot: Robot, time_ns: int) -> NDArray[np.float64]:
        """(256,) share of the weighted pixels at each grey level of what a robot sees at a
        time [ns]."""
        picture = self._picture(robot, time_ns)
        grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
        weights = self._weights[robot].ravel()
        return np.bincount(grey.ravel(), weights, 256).astype(np.float64)

    def _picture(self, robot: Robot, time_ns: int) -> NDArray[np.uint8]:
        """(height, width, 3) picture with all light that changes."""
        plan, camera = self._plan, self._cameras[robot]
        pose = self._motion.camera_pose(robot, time_ns)
        picture, depth = self._draw(plan.worlds[robot], robot, time_ns)
        shadow = plan.shadows.get(robot)
        if shadow is not None:
            mav = self._motion.pose("mav", time_ns).translation
            picture = shadow.cast(picture, depth, camera, pose, mav)
        if robot == "ground" and plan.unlit is not None and plan.lamp is not None:
            unlit, _ = self._draw(plan.unlit, robot, time_ns)
            picture = plan.lamp.lit(picture, unlit, depth, camera.rays())
        return picture

    def _draw(
        self, files: WorldFiles, robot: Robot, time_ns: int
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        renderer = self._renderers[files]
        BodiesInView(robot, self._bodies).place(renderer, time_ns)
        return renderer.draw(meter_name(robot), self._motion.camera_pose(robot, time_ns))


def _weights(camera: PinholeCamera) -> NDArray[np.float64]:
    """(height, width) weights with a sum of 1, largest in the middle."""
    x = np.linspace(-0.5, 0.5, camera.width) / _SPREAD
    y = np.linspace(-0.5, 0.5, camera.height) / _SPREAD
    weights = np.exp(-0.5 * (x[None, :] ** 2 + y[:, None] ** 2))
    return np.asarray(weights / weights.sum())
