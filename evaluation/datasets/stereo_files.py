"""The right images of stereo pairs, in EuRoC's form of a camera, for a recording that exists."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np

from airground.config import Config
from airground.core.se3 import SE3
from airground.errors import InputError
from airground.io.euroc import camera_yaml, write_image_list
from airground.io.header import Header
from airground.io.recording_writer import mav_image_name
from evaluation.datasets.pixel_truth_files import Wanted
from evaluation.datasets.simulated import Simulated
from evaluation.measure.plans.dials import Subject, turned
from evaluation.setup.output import fresh_folder
from sim.recording.frame_pool import Picture, frame_workers, make_pictures
from sim.recording.recorder import Flight
from sim.recording.redraw import redrawn
from sim.robots.motion import Robot
from sim.scene import load_scene
from sim.sensors.presets import sensor_preset

BASELINE_M = 0.11
"""EuRoC's baseline [m]."""


def render_stereo(
    simulated: Simulated,
    wanted: Wanted,
    baseline_m: float,
    scene: str | None,
    out: Path,
    workers: int,
    done: Callable[[int], None],
) -> None:
    """Write `out/ROBOT_stereo/` for each robot wanted; each folder is whole or not there.

    Args:
        simulated: Recording with its truth.
        wanted: Whose images, and how many of them.
        baseline_m: Distance of the right camera from the recorded one [m].
        scene: Name or file of its scene; None for the one of that name in the package.
        out: Folder to write into.
        workers: Number of processes that draw.
        done: Called with the number of images written since the last call.

    Raises:
        InputError: A folder exists, the scene is unknown, or it does not give this recording.
    """
    recording, robots = simulated.recording, wanted.robots
    flight = flight_of(recording.header, scene)
    if "ground" in robots and flight.scene.ground.lamp > 0:
        raise InputError(
            f"{recording.path}: the lamp at the ground robot's camera is not drawn from beside it; "
            "give --robot mav"
        )
    with ExitStack() as stack:
        folders = {
            robot: stack.enter_context(fresh_folder(out / f"{robot}_stereo")) for robot in robots
        }
        pictures = [
            picture
            for robot, folder in folders.items()
            for picture in _camera_folder(folder, simulated, robot, baseline_m, wanted.every)
        ]
        pool = stack.enter_context(frame_workers(workers))
        plan = stack.enter_context(redrawn(recording, flight, robots))
        for count in make_pictures(replace(plan, baseline_m=baseline_m), pictures, pool):
            done(count)


def flight_of(header: Header, scene: str | None) -> Flight:
    """What a recording was made from, by its header.

    Args:
        header: The recording's header.
        scene: Name or file of its scene; None for the one of that name in the package.

    Raises:
        InputError: Scene or preset are unknown, or the scene has another name.
    """
    try:
        loaded = load_scene(scene or header.scene)
        preset = sensor_preset(header.sensors)
    except InputError as error:
        given = "" if scene else "; give the file of the scene with --scene"
        raise InputError(f"{error}{given if 'scene' in str(error) else ''}") from None
    if loaded.name != header.scene:
        raise InputError(
            f"--scene {scene}: its name is '{loaded.name}', the recording is of '{header.scene}'"
        )
    dials = header.dials or {}
    subject = turned(Subject(loaded, preset, Config()), dials)
    return Flight(
        subject.scene,
        header.seed,
        header.flight,
        subject.sensors,
        header.duration_s,
        header.dials,
        header.frames.robots(),
    )


def count_pairs(simulated: Simulated, wanted: Wanted) -> int:
    """How many images `render_stereo` writes."""
    return sum(-(-len(simulated.stamps_ns(robot)) // wanted.every) for robot in wanted.robots)


def _camera_folder(
    folder: Path, simulated: Simulated, robot: Robot, baseline_m: float, every: int
) -> list[Picture]:
    """Write `sensor.yaml` and `data.csv` of the right camera; the pictures that belong to them."""
    nominal = simulated.nominal(robot)
    T_left_right = SE3(np.eye(3), np.array([baseline_m, 0.0, 0.0]))
    yaml = camera_yaml(nominal.camera, simulated.T_imu_camera(robot) @ T_left_right)
    (folder / "sensor.yaml").write_text(yaml, encoding="utf-8")
    (folder / "data").mkdir()
    stamps = simulated.stamps_ns(robot)
    chosen = range(0, len(stamps), every)
    names = [mav_image_name(stamps[index]) for index in chosen]
    write_image_list(folder / "data.csv", np.array([stamps[index] for index in chosen]), names)
    return [
        (robot, index, folder / "data" / name) for index, name in zip(chosen, names, strict=True)
    ]
