"""Truth of every pixel as image files, in lossless encodings that other tools read.

docs/datasets.md states the encodings.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.errors import AirgroundError, InputError
from evaluation.datasets.simulated import Simulated
from evaluation.setup.output import fresh_folder
from sim.geometry.parts import KINDS, Instances
from sim.recording.pixel_truth import (
    flow,
    instance_ids,
    instances_of,
    pixel_truth,
)
from sim.robots.motion import Robot

MODALITIES = ("depth", "normals", "segmentation", "flow")
LIDAR = "lidar"
STEREO = "stereo"
KNOWN = (*MODALITIES, LIDAR, STEREO)
"""What can be added to a recording: truth of every pixel, scans of a lidar, and right images."""
FLOW_STEP_PX = 1 / 64
"""Resolution of KITTI's 16-bit flow [px]."""
_FLOW_ZERO, _NORMAL_ZERO = 32768, 32768
_LZW = [cv2.IMWRITE_TIFF_COMPRESSION, 5]


@dataclass(frozen=True, eq=False)
class PixelFile:
    """One image file: its modality, its place in that folder, and pixels as cv2 writes them."""

    modality: str
    name: str
    pixels: NDArray


@dataclass(frozen=True, eq=False)
class Wanted:
    """What is rendered.

    Attributes:
        robots: Robots whose images are rendered.
        modalities: Some of `MODALITIES`.
        every: Every so many-th image; flow leads to the next of all images.
    """

    robots: tuple[Robot, ...]
    modalities: tuple[str, ...]
    every: int = 1


def parse_modalities(words: str) -> tuple[str, ...]:
    """`depth,flow` as a tuple in the order of `KNOWN`; InputError names a wrong word."""
    asked = [word.strip() for word in words.split(",")]
    for word in asked:
        if word not in KNOWN:
            raise InputError(f"--add {word}: unknown; known: {', '.join(KNOWN)}")
    return tuple(name for name in KNOWN if name in asked)


def render_truth(
    simulated: Simulated, wanted: Wanted, out: Path, workers: int, done: Callable[[], None]
) -> None:
    """Write `out/ROBOT_MODALITY/` for everything wanted; each folder is whole or not there.

    Args:
        simulated: Recording with its truth.
        wanted: What is rendered.
        out: Folder to write into.
        workers: Number of threads that encode.
        done: Called after each image.

    Raises:
        InputError: One of the folders exists.
        RecordingError: The truth lacks what is needed.
    """
    segmented = wanted.robots if "segmentation" in wanted.modalities else ()
    instances = {robot: instances_of(simulated.truth, robot) for robot in segmented}
    with ExitStack() as stack, ThreadPoolExecutor(workers) as pool:
        folders = {
            (robot, name): stack.enter_context(fresh_folder(out / f"{robot}_{name}"))
            for robot in wanted.robots
            for name in wanted.modalities
        }
        for robot in segmented:
            _write_table(folders[robot, "segmentation"] / "instances.csv", instances[robot])
        written: Iterator[None] = iter(())
        for robot, index in _chosen(simulated, wanted):
            files = _files(simulated, wanted, instances.get(robot), robot, index)
            list(written)  # the image before is encoded while the rays of this one are cast
            places = [(folders[robot, file.modality], file) for file in files]
            written = pool.map(_write, *zip(*places, strict=True))
            done()
        list(written)


def count_images(simulated: Simulated, wanted: Wanted) -> int:
    """How many images `render_truth` renders."""
    return sum(1 for _ in _chosen(simulated, wanted))


def _chosen(simulated: Simulated, wanted: Wanted) -> Iterator[tuple[Robot, int]]:
    for robot in wanted.robots:
        for index in range(0, len(simulated.stamps_ns(robot)), wanted.every):
            yield robot, index


def _files(
    simulated: Simulated, wanted: Wanted, instances: Instances | None, robot: Robot, index: int
) -> list[PixelFile]:
    """All files of one image."""
    truth, stamps = simulated.truth, simulated.stamps_ns(robot)
    seen = pixel_truth(truth, robot, stamps[index])
    made: dict[str, dict[str, NDArray]] = {}
    if "depth" in wanted.modalities:
        made["depth"] = {"{}.tif": seen.depth}
    if "normals" in wanted.modalities:
        made["normals"] = {"{}.png": normals_image(seen.normals)}
    if instances is not None:
        ids = instance_ids(seen, instances)
        made["segmentation"] = {
            "instance/{}.png": ids,
            "class/{}.png": instances.class_ids()[ids],
        }
    if "flow" in wanted.modalities and index + 1 < len(stamps):
        moved = flow(truth, robot, seen, stamps[index + 1])
        known = np.isfinite(moved.flow_px[..., 0])
        made["flow"] = {
            "flow_occ/{}.png": flow_image(moved.flow_px, known),
            "flow_noc/{}.png": flow_image(moved.flow_px, moved.visible),
        }
    return [
        PixelFile(modality, name.format(stamps[index]), pixels)
        for modality, files in made.items()
        for name, pixels in files.items()
    ]


def normals_image(normals: NDArray[np.float32]) -> NDArray[np.uint16]:
    """(height, width, 3) 16-bit RGB of x, y and z: 32768 + 32767 times each; 0 is nothing."""
    units = np.rint(_NORMAL_ZERO + 32767 * normals.astype(np.float64))
    image = np.where(np.isfinite(units), units, 0).astype(np.uint16)
    return np.ascontiguousarray(image[..., ::-1])  # cv2 writes BGR


def flow_image(flow_px: NDArray[np.float32], valid: NDArray[np.bool_]) -> NDArray[np.uint16]:
    """(height, width, 3) of RGB: 32768 + 64 u, 32768 + 64 v, and 1 where valid.
    Flow beyond 512 px does not fit and is not valid."""
    units = np.rint(_FLOW_ZERO + flow_px.astype(np.float64) / FLOW_STEP_PX)
    fits = valid & ((units >= 0) & (units <= 65535)).all(-1)
    image = np.zeros((*fits.shape, 3), np.uint16)
    image[fits, 0] = 1
    image[fits, 1], image[fits, 2] = units[fits, 1], units[fits, 0]  # cv2 writes BGR
    return image


def _write(folder: Path, file: PixelFile) -> None:
    path = folder / file.name
    path.parent.mkdir(exist_ok=True)
    settings = _LZW if path.suffix == ".tif" else []
    if not cv2.imwrite(str(path), file.pixels, settings):
        raise AirgroundError(f"{path}: cannot be written; is the disk full?")


def _write_table(path: Path, instances: Instances) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["instance", "name", "class_id", "class"])
        for index, (name, kind) in enumerate(
            zip(instances.names, instances.kinds, strict=True), start=1
        ):
            writer.writerow([index, name, KINDS.index(kind) + 1, kind])
