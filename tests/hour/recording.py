"""A long recording of laps that takes the disk of one: images of later laps are links to its files.

All else is measured anew in every lap: inertial and magnetic samples with their noise and drift.
Only the noise of images repeats.
"""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

from airground.io import layout, recording_writer
from airground.io.recording_writer import ground_image_name, mav_image_name
from sim.partial_folder import partial_folder
from sim.recording import recorder
from sim.recording.frame_pool import frame_workers
from sim.recording.frames import FramePlan
from sim.recording.recorder import Flight, with_models, write_all_but_images
from sim.robots.motion import Motion, Robot
from sim.scene import Scene
from sim.sensors.faulty_frames import FaultyFrames
from sim.sensors.presets import CAMERA_RATE_HZ, SensorPreset
from sim.world.world import World
from tests.hour.laps import BEFORE_S, fly_laps

FOLDERS: dict[Robot, tuple[str, ...]] = {
    "mav": (layout.MAV_IMAGES,),
    "ground": (layout.GROUND_COLOUR, layout.GROUND_DEPTH),
}
NAMES: dict[Robot, Callable[[int], str]] = {"mav": mav_image_name, "ground": ground_image_name}


def record_laps(
    scene: Scene, seed: int, preset: SensorPreset, out: Path, duration_s: float, workers: int
) -> float:
    """Record laps into a folder that does not exist; returns the length of a lap [s].
    `workers` processes draw the images up to the end of the first lap."""
    laps: list[float] = []

    def fly(world: World, scene: Scene, seed: int, duration_s: float) -> Motion:
        flown = fly_laps(world, scene, seed, duration_s)
        laps.append(flown.lap_s)
        return flown.motion

    flight = Flight(scene, seed, 0, preset, duration_s)
    with partial_folder(out) as root, frame_workers(workers) as pool:
        with patch.object(recorder, "simulate_motion", fly):
            header, plan, plain = write_all_but_images(root, flight)
        stamps_ns = plan.taken_ns
        plan = with_models(_first_lap(plan, laps[0]), plain)
        digests = defaultdict(dict, recorder._render(plan, pool, None))
        for robot, whole in stamps_ns.items():
            _link(root, robot, whole, len(plan.taken_ns[robot]), laps[0], digests)
        for files in plan.world_files():
            files.model.unlink()
            files.edges.unlink()
        recording_writer.finish(root, header, digests)
        root.rename(out)
    return laps[0]


def _first_lap(plan: FramePlan, lap_s: float) -> FramePlan:
    """The images up to the end of the first lap."""
    end_ns = round((BEFORE_S + lap_s) * 1e9)
    taken = {robot: stamps[stamps < end_ns] for robot, stamps in plan.taken_ns.items()}
    return replace(
        plan, taken_ns=taken, frames={r: FaultyFrames.of(one, ()) for r, one in taken.items()}
    )


def _link(
    root: Path,
    robot: Robot,
    stamps_ns: np.ndarray,
    drawn: int,
    lap_s: float,
    digests: dict[str, dict[str, str]],
) -> None:
    """Link every image after the `drawn` ones to that of the same place in the first lap."""
    lap, name = round(lap_s * CAMERA_RATE_HZ), NAMES[robot]
    for index in range(drawn, len(stamps_ns)):
        source = name(int(stamps_ns[drawn - lap + (index - drawn) % lap]))
        target = name(int(stamps_ns[index]))
        for folder in FOLDERS[robot]:
            os.link(root / folder / source, root / folder / target)
            digests[folder][target] = digests[folder][source]
