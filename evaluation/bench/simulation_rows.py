"""Work of the simulator: drawing images, their sensors' faults, and encoding them.

The images are those of a flight over `SCENE` with nominal sensors, whatever recording is played.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from itertools import cycle
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from airground.core.scratch_folder import ScratchFolder
from airground.io.png_encoder import encode_png
from evaluation.bench.material import Material
from evaluation.bench.work import Work
from sim.recording.frames import FrameMaker, FramePlan
from sim.recording.recorder import Flight, with_models, write_all_but_images
from sim.recording.render import draw_with
from sim.robots.motion import Robot
from sim.scene import load_scene
from sim.sensors.depth import kinect_depth
from sim.sensors.presets import NOMINAL

Input = TypeVar("Input")

SCENE = "indoor_a"
SEED = 4
DURATION_S = 20.0
"""The MAV is in the air for 12 s of it."""
IMAGES = 12
"""Images of each robot taken in turn, from the second half of the flight."""


@dataclass(frozen=True, eq=False)
class Simulated:
    """A flight whose images can be made."""

    plan: FramePlan
    maker: FrameMaker

    def indices(self, robot: Robot) -> list[int]:
        """Numbers of the images that are taken in turn."""
        count = len(self.plan.frames[robot].stamps_ns)
        return [int(index) for index in np.linspace(count // 2, count - 1, IMAGES)]

    def times_ns(self, robot: Robot) -> list[int]:
        """When these are taken [ns]."""
        return [self.maker.start(robot, index)[0] for index in self.indices(robot)]

    def size(self, robot: Robot) -> str:
        camera = self.maker.rays[robot].camera
        return f"{camera.width} x {camera.height} px"


@cache
def simulated() -> Simulated:
    """The flight, made once in a process; only the world's file is needed, and that is read."""
    draw_with(len(os.sched_getaffinity(0)))
    with ScratchFolder() as folder:
        flight = Flight(load_scene(SCENE), SEED, 0, NOMINAL, DURATION_S)
        _, plan, plain = write_all_but_images(folder.path, flight)
        plan = with_models(plan, plain)
        return Simulated(plan, FrameMaker(plan))


def draw(robot: Robot, _: Material) -> Work:
    """Draw a picture and its depth, with smooth edges."""
    flight = simulated()
    view = flight.maker.views[robot]
    return Work(_in_turn(view.draw, flight.times_ns(robot)), size=flight.size(robot))


def expose(robot: Robot, _: Material) -> Work:
    """Motion blur, vignetting, exposure and noise of a picture."""
    flight, rng = simulated(), np.random.default_rng(0)
    drawn = [(flight.maker.views[robot].draw(t), t) for t in flight.times_ns(robot)]

    def work(one: tuple[tuple[NDArray, NDArray], int]) -> NDArray:
        (picture, depth), time_ns = one
        return flight.maker.expose(robot, picture, depth, time_ns, rng)

    return Work(_in_turn(work, drawn), size=flight.size(robot))


def depth_noise(_: Material) -> Work:
    """The Kinect's noise and gaps on a depth image."""
    flight, rng = simulated(), np.random.default_rng(0)
    assert NOMINAL.depth is not None
    measure = partial(kinect_depth, rays=flight.maker.rays["ground"], noise=NOMINAL.depth, rng=rng)
    view = flight.maker.views["ground"]
    depths = [view.depth(time_ns) for time_ns in flight.times_ns("ground")]
    return Work(_in_turn(measure, depths), size=flight.size("ground"))


def encode_grey(_: Material) -> Work:
    """PNG of the MAV's images."""
    flight = simulated()
    images = [flight.maker.mav(index) for index in flight.indices("mav")]
    return Work(_in_turn(encode_png, images), size=flight.size("mav"))


def encode_rgbd(_: Material) -> Work:
    """PNG of the ground robot's images, colour and depth."""
    flight = simulated()
    pairs = [flight.maker.ground(index) for index in flight.indices("ground")]

    def work(pair: tuple[NDArray, NDArray]) -> list[bytes]:
        return [encode_png(image) for image in pair]

    return Work(_in_turn(work, pairs), size=flight.size("ground"))


def _in_turn(work: Callable[[Input], object], inputs: list[Input]) -> Callable[[], object]:
    """Calls the work with the next input, again from the first after the last."""
    turns = cycle(inputs)
    return lambda: work(next(turns))
