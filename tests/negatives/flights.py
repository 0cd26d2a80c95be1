"""Surfaces and ground maps of short simulated flights: SLAM, depth maps and fusion as in life."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airground.config import Config
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from evaluation.measure.protocol.mapping_pass import map_recording
from evaluation.setup.setups import Setup
from evaluation.table.truth_errors import true_T_ground_mav
from sim.recording.recorder import Flight, rendered
from sim.recording.truth import Truth
from sim.scene import load_scene
from sim.sensors.presets import sensor_preset
from tests.negatives.views import Flown, View

DURATION_S = 20.0
"""Length of a flight: several aerial maps of a heap of 3 x 3 m."""


def flights(heaps: int, folder: Path) -> list[Flown]:
    """Flights over `heaps` different heaps, and one over a flat floor (the last).
    Maps that are in the folder are read; the others are made, about a minute each, and kept."""
    folder.mkdir(parents=True, exist_ok=True)
    wanted = [("tiny", seed) for seed in range(heaps)] + [("flat", 0)]
    return [_flown(scene, seed, folder) for scene, seed in wanted]


def _flown(scene: str, seed: int, folder: Path) -> Flown:
    path = folder / f"{scene}_{seed}.npz"
    if not path.exists():
        flight = Flight(load_scene(scene), seed, 0, sensor_preset("nominal"), DURATION_S)
        with rendered(flight, 1) as recording:
            truth = Truth.open(recording.path)
            maps = map_recording(recording, truth, Setup(Config()), seed)
        store(path, [_view(sighting, truth) for sighting in maps.sightings])
    return load(path)


def _view(sighting: Sighting, truth: Truth) -> View:
    surface = sighting.surface
    return View(
        surface.cloud_mav.points,
        surface.T_mav_camera.translation,
        sighting.ground_cloud.points,
        sighting.T_ground_camera.translation[:2],
        float("nan") if sighting.heading is None else sighting.heading,
        true_T_ground_mav(sighting, truth),
    )


def store(path: Path, views: list[View]) -> None:
    """Write the views of a flight; a half-written file never has the name."""
    arrays: dict[str, NDArray] = {"count": np.array(len(views))}
    for k, view in enumerate(views):
        assert view.T_ground_mav is not None
        arrays |= {f"aerial_{k}": view.aerial, f"ground_{k}": view.ground}
        motion = np.column_stack([view.T_ground_mav.rotation, view.T_ground_mav.translation])
        arrays[f"pose_{k}"] = np.vstack([motion, [*view.robot, view.heading, 0], [*view.camera, 0]])
    partial = path.with_suffix(".partial.npz")
    np.savez_compressed(partial, allow_pickle=False, **arrays)
    partial.rename(path)


def load(path: Path) -> Flown:
    """Views that `store` has written."""
    views = []
    with np.load(path) as kept:
        for k in range(int(kept["count"])):
            pose = kept[f"pose_{k}"]
            motion = SE3(pose[:3, :3], pose[:3, 3])
            aerial, ground = kept[f"aerial_{k}"], kept[f"ground_{k}"]
            views.append(View(aerial, pose[4, :3], ground, pose[3, :2], float(pose[3, 2]), motion))
    return Flown(path.stem, tuple(views))
