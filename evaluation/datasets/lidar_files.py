"""Scans of a lidar as PCD files, which PCL, ROS and Open3D read, each point with its own time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np
import tomli_w
from numpy.typing import NDArray

from airground.core.se3 import SE3
from evaluation.datasets.simulated import Simulated
from evaluation.setup.output import fresh_folder
from sim.recording.lidar_scan import lidar_scan, scan_starts_ns
from sim.sensors.lidar import Lidar

FOLDER, SENSOR = "ground_lidar", "sensor.toml"
_NOISE = 3
"""Numbers 1 and 2 seed the noise of the cameras."""


def render_scans(
    simulated: Simulated, lidar: Lidar, every: int, out: Path, done: Callable[[], None]
) -> None:
    """Write `out/ground_lidar/` with a file for each scan, named by its start on the clock of the
    ground robot; it is whole or not there.

    Args:
        simulated: Recording with its truth.
        lidar: The sensor.
        every: Every so many-th scan.
        out: Folder to write into.
        done: Called after each scan.

    Raises:
        InputError: The folder exists.
    """
    truth, header = simulated.truth, simulated.recording.header
    T_body_lidar = lidar.mounting(truth.motion.ground.mounting.T_body_camera)
    with fresh_folder(out / FOLDER) as folder:
        sensor = asdict(lidar) | {"T_body_lidar": T_body_lidar.matrix().tolist()}
        (folder / SENSOR).write_text(tomli_w.dumps(sensor), encoding="utf-8")
        starts_ns = scan_starts_ns(truth, lidar)
        stamps_ns = truth.clock("ground").stamps_ns(starts_ns)
        for index in range(0, len(starts_ns), every):
            rng = np.random.default_rng([header.seed, header.flight, _NOISE, index + 1])
            start_ns = int(starts_ns[index])
            write_pcd(folder / f"{stamps_ns[index]}.pcd", lidar_scan(truth, lidar, start_ns, rng))
            done()


def count_scans(simulated: Simulated, lidar: Lidar, every: int) -> int:
    """How many scans `render_scans` writes."""
    return -(-len(scan_starts_ns(simulated.truth, lidar)) // every)


def write_pcd(path: Path, points: NDArray[np.void]) -> None:
    """Write a structured array as a binary PCD file of version 0.7."""
    kinds = [points.dtype[name] for name in points.dtype.names or ()]
    identity = SE3.identity()
    viewpoint = [*identity.translation, *np.roll(identity.quaternion_xyzw(), 1)]
    header = {
        "VERSION": "0.7",
        "FIELDS": " ".join(points.dtype.names or ()),
        "SIZE": " ".join(str(kind.itemsize) for kind in kinds),
        "TYPE": " ".join(kind.kind.upper() for kind in kinds),
        "COUNT": " ".join("1" for _ in kinds),
        "WIDTH": str(len(points)),
        "HEIGHT": "1",
        "VIEWPOINT": " ".join(f"{number:g}" for number in viewpoint),
        "POINTS": str(len(points)),
        "DATA": "binary",
    }
    text = "".join(f"{key} {value}\n" for key, value in header.items())
    path.write_bytes(text.encode("ascii") + points.tobytes())
