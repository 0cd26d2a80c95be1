"""Images of a flight: any frame of either robot, the same in any process and order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.io import layout
from airground.io.calibration import CalibrationTable, GroundTable, RobotTable
from airground.io.digests import bytes_digest
from airground.io.lens import Lens
from airground.io.png_encoder import encode_png
from airground.io.recording_writer import ground_image_name, mav_image_name
from sim.geometry.edges import Edges
from sim.recording.carried_lamp import CarriedLamp
from sim.recording.depth_camera import VIEW, DepthCamera, true_depth_camera
from sim.recording.drone_shadow import DroneShadow
from sim.recording.render import Renderer
from sim.recording.robot_view import RobotView
from sim.robots.motion import ROBOTS, Motion, Robot
from sim.robots.moving_bodies import read_bodies
from sim.sensors.auto_exposure import Exposure, ExposureCourse
from sim.sensors.camera import ImageSensor
from sim.sensors.faulty_frames import FaultyFrames
from sim.sensors.pixel_rays import PixelRays
from sim.sensors.presets import SensorPreset


@dataclass(frozen=True)
class WorldFiles:
    """Files of a compiled world with both cameras, and of its edges."""

    model: Path
    edges: Path


@dataclass(frozen=True, eq=False)
class FramePlan:
    """All that a process needs to make frames.

    Attributes:
        recording: Folder that images are written into.
        worlds: What each robot sees.
        motion: File of the motion, beside those of bodies that move.
        unlit: What the ground robot sees, without light, for the lamp that it carries.
        lamp: The lamp; None without one.
        shadows: The MAV's shadow in the light that each robot sees; none if it throws none.
        baseline_m: Distance of each camera to the right of its own place, along its x axis, for
            the right images of stereo pairs [m]; their noise is their own.
        true: True calibration of the sensors.
        driver: Nominal calibration by which depth is registered; None if it is not.
        taken_ns: Nominal stamps at which each robot's camera takes an image [ns].
        frames: The frames that are left of them by faults of the sensors, of the robots that are
            recorded.
        exposures: Courses of the cameras' automatic exposure; none if exposure is fixed.
    """

    recording: Path
    worlds: dict[Robot, WorldFiles]
    motion: Path
    true: CalibrationTable
    driver: GroundTable | None
    preset: SensorPreset
    seeds: tuple[int, int]
    taken_ns: dict[Robot, NDArray[np.int64]]
    frames: dict[Robot, FaultyFrames]
    unlit: WorldFiles | None = None
    lamp: CarriedLamp | None = None
    shadows: Mapping[Robot, DroneShadow] = field(default_factory=dict)
    exposures: Mapping[Robot, ExposureCourse] = field(default_factory=dict)
    baseline_m: float = 0.0

    def world_files(self) -> set[WorldFiles]:
        """Files of all worlds."""
        unlit = set() if self.unlit is None else {self.unlit}
        return set(self.worlds.values()) | unlit

    def exposures_of_images(self) -> dict[Robot, list[tuple[int, Exposure]]]:
        """Stamps of all images [ns] and how automatic exposure took each."""
        return {robot: self._exposures(robot, course) for robot, course in self.exposures.items()}

    def _exposures(self, robot: Robot, course: ExposureCourse) -> list[tuple[int, Exposure]]:
        frames, table = self.frames[robot], self.true.mav if robot == "mav" else self.true.ground
        times_ns = self.taken_ns[robot][frames.taken] + table.camera.time_offset_ns
        return [
            (int(stamp), course.at(int(time_ns)))
            for stamp, time_ns in zip(frames.stamps_ns, times_ns, strict=True)
        ]


@dataclass(frozen=True)
class Written:
    """An image file: its folder in the recording, its name and its SHA-256."""

    folder: str
    name: str
    digest: str


class FrameMaker:
    """Draws frames with their sensors' faults; a context manager, for the graphics context.

    Attributes:
        views: What each robot's camera sees before its sensor's faults.
        rays: Where each camera's pixels look.
        depth_camera: The ground robot's depth camera.
    """

    def __init__(self, plan: FramePlan) -> None:
        self._plan = plan
        self._motion = Motion.load(plan.motion)
        if plan.baseline_m:
            T_camera_right = SE3(np.eye(3), np.array([plan.baseline_m, 0.0, 0.0]))
            for robot in ROBOTS:
                self._motion = self._motion.with_camera_moved(robot, T_camera_right)
        self._bodies = read_bodies(plan.motion.parent)
        # One world that both robots see is loaded once.
        edges = {files: Edges.load(files.edges) for files in plan.worlds.values()}
        renderers = {files: _renderer(files) for files in edges}
        self._renderers = list(renderers.values())
        self.views = {
            robot: self._view(robot, renderers[files], edges[files], plan.shadows.get(robot))
            for robot, files in plan.worlds.items()
        }
        self._unlit: RobotView | None = None
        if plan.unlit is not None:
            self._renderers.append(_renderer(plan.unlit))
            of_drive = edges[plan.worlds["ground"]]
            self._unlit = self._view("ground", self._renderers[-1], of_drive, None)
        self.depth_camera = self._depth_camera(renderers, edges)
        self.rays = {robot: PixelRays.of(self._lens(robot)) for robot in ROBOTS}
        self._sensors: dict[Robot, ImageSensor] = {}
        if plan.preset.image is not None:
            for number, robot in enumerate(ROBOTS, start=1):
                rng = np.random.default_rng([*plan.seeds, number])
                self._sensors[robot] = ImageSensor.of(self.rays[robot], plan.preset.image, rng)

    def __enter__(self) -> FrameMaker:
        return self

    def __exit__(self, *_: object) -> None:
        for renderer in self._renderers:
            renderer.close()

    def make(self, robot: Robot, index: int) -> list[Written]:
        """Write the files of one frame."""
        stamp = int(self._plan.frames[robot].stamps_ns[index])
        if robot == "mav":
            return [self._write(layout.MAV_IMAGES, mav_image_name(stamp), self.mav(index))]
        colour, depth_units = self.ground(index)
        name = ground_image_name(stamp)
        return [
            self._write(layout.GROUND_COLOUR, name, colour),
            self._write(layout.GROUND_DEPTH, name, depth_units),
        ]

    def mav(self, index: int) -> NDArray[np.uint8]:
        """(height, width) grey image of the MAV."""
        time_ns, rng = self.start("mav", index)
        grey, depth = self.views["mav"].draw(time_ns)
        if "mav" in self._sensors:
            grey = self.expose("mav", grey, depth, time_ns, rng)
        return self._plan.frames["mav"].image(index, np.asarray(grey[..., 0], np.uint8))

    def ground(self, index: int) -> tuple[NDArray[np.uint8], NDArray[np.uint16]]:
        """(height, width, 3) RGB and (height, width) depth as PNG values, of the ground robot."""
        time_ns, rng = self.start("ground", index)
        colour, depth = self._colour(time_ns, rng)
        frames = self._plan.frames["ground"]
        units = frames.depth_units(index, self.depth_camera.units(time_ns, depth, rng))
        return frames.image(index, colour), units

    def picture(self, robot: Robot, index: int) -> NDArray[np.uint8]:
        """The image of a frame without depth: grey of the MAV, RGB of the ground robot."""
        if robot == "mav":
            return self.mav(index)
        colour, _ = self._colour(*self.start("ground", index))
        return self._plan.frames["ground"].image(index, colour)

    def _colour(
        self, time_ns: int, rng: np.random.Generator
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """The ground robot's colour image and the true depth of its pixels [m]."""
        colour, depth = self.views["ground"].draw(time_ns)
        if self._unlit is not None and self._plan.lamp is not None:
            unlit, _ = self._unlit.draw(time_ns)
            colour = self._plan.lamp.lit(colour, unlit, depth, self._lens("ground").rays())
        if "ground" in self._sensors:
            colour = self.expose("ground", colour, depth, time_ns, rng)
        return colour, depth

    def start(self, robot: Robot, index: int) -> tuple[int, np.random.Generator]:
        """When a frame is really taken [ns], and what its noise is drawn from."""
        taken = int(self._plan.frames[robot].taken[index])
        stamp = int(self._plan.taken_ns[robot][taken])
        # Noise depends on the frame alone, not on who makes it. Counted from 1, for numpy
        # takes [a] and [a, 0] as the same seed.
        right = [1] if self._plan.baseline_m else []
        seed = [*self._plan.seeds, ROBOTS.index(robot) + 1, taken + 1, *right]
        rng = np.random.default_rng(seed)
        return stamp + self._table(robot).camera.time_offset_ns, rng

    def _view(
        self, robot: Robot, renderer: Renderer, edges: Edges, shadow: DroneShadow | None
    ) -> RobotView:
        lens, grey = self._lens(robot), robot == "mav"
        motion, bodies = self._motion, self._bodies
        return RobotView(robot, lens, motion, renderer, edges, grey, bodies, shadow)

    def _depth_camera(
        self, renderers: dict[WorldFiles, Renderer], edges: dict[WorldFiles, Edges]
    ) -> DepthCamera:
        true, view = self._plan.true.ground, self.views["ground"]
        if true.depth.camera is not None:
            files = self._plan.worlds["ground"]
            camera, T_camera_depth = true_depth_camera(true)
            motion = self._motion.with_camera_moved("ground", T_camera_depth)
            drawing = motion, renderers[files], edges[files]
            view = RobotView("ground", camera.lens(), *drawing, True, self._bodies, name=VIEW)
        return DepthCamera(true, self._plan.driver, self._plan.preset.depth, view)

    def expose(
        self, robot: Robot, sharp: NDArray, depth: NDArray, time_ns: int, rng: np.random.Generator
    ) -> NDArray[np.uint8]:
        """The picture that a robot's sensor takes of what its view has drawn at a time [ns]."""
        sensor = self._sensors[robot]
        course = self._plan.exposures.get(robot)
        exposure = sensor.fixed if course is None else course.at(time_ns)
        half_ns = round(exposure.exposure_s * 0.5e9)
        start = self._motion.camera_pose(robot, time_ns - half_ns)
        T_start_end = start.inverse() @ self._motion.camera_pose(robot, time_ns + half_ns)
        return sensor.expose(sharp, depth, T_start_end, time_ns * 1e-9, rng, exposure)

    def _write(self, folder: str, name: str, image: NDArray) -> Written:
        data = encode_png(image)
        (self._plan.recording / folder / name).write_bytes(data)
        return Written(folder, name, bytes_digest(data))

    def _lens(self, robot: Robot) -> Lens:
        return self._table(robot).camera.lens()

    def _table(self, robot: Robot) -> RobotTable:
        return self._plan.true.mav if robot == "mav" else self._plan.true.ground


def _renderer(files: WorldFiles) -> Renderer:
    return Renderer(mujoco.MjModel.from_binary_path(str(files.model)))
