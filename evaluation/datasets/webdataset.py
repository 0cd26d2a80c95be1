"""Images, depth and true poses as shards for WebDataset, described for Hugging Face and Croissant.

A shard is a tar file. Files with one key before the first dot are one sample: `mav_STAMP.grey.png`,
`ground_STAMP.colour.png`, `ground_STAMP.depth.png`, each with `.json`.
"""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from airground.io.images import read_image_bytes
from airground.io.lens import Lens
from evaluation.datasets.dataset_card import Shard, write_croissant, write_dataset_card
from evaluation.datasets.simulated import Simulated
from sim.robots.motion import Robot

SHARD_BYTES = 256 * 2**20
"""A shard is closed once it has this size [bytes]; a minute of one robot is one to four."""
DATA = "data"
_END = 2 * tarfile.BLOCKSIZE


@dataclass(frozen=True)
class Sample:
    """One image with what belongs to it; `files` by the end of their names."""

    key: str
    files: dict[str, bytes]

    def size(self) -> int:
        """What it takes in a tar file [bytes]."""
        blocks = sum(1 + -(-len(data) // tarfile.BLOCKSIZE) for data in self.files.values())
        return blocks * tarfile.BLOCKSIZE


def write_webdataset(folder: Path, simulated: Simulated, robots: tuple[Robot, ...]) -> None:
    """Fill an empty folder with shards in `data/`, a dataset card and `croissant.json`."""
    (folder / DATA).mkdir()
    shards = [shard for robot in robots for shard in _write_shards(folder, simulated, robot)]
    write_dataset_card(folder, simulated.recording.header, shards)
    write_croissant(folder, simulated.recording.header, shards)


def _write_shards(folder: Path, simulated: Simulated, robot: Robot) -> Iterator[Shard]:
    samples = _samples(simulated, robot)
    number, next_ = 0, next(samples, None)
    while next_ is not None:
        path = folder / DATA / f"{robot}-{number:05d}.tar"
        count, size = 0, _END
        with tarfile.open(path, "w", format=tarfile.USTAR_FORMAT) as shard:
            while next_ is not None and (count == 0 or size + next_.size() <= SHARD_BYTES):
                _add(shard, next_)
                count, size = count + 1, size + next_.size()
                next_ = next(samples, None)
        yield Shard(robot, path, count)
        number += 1


def _add(shard: tarfile.TarFile, sample: Sample) -> None:
    """Without times and owners, so that the same recording gives the same bytes."""
    for end, data in sample.files.items():
        entry = tarfile.TarInfo(f"{sample.key}.{end}")
        entry.size = len(data)
        shard.addfile(entry, io.BytesIO(data))


def _samples(simulated: Simulated, robot: Robot) -> Iterator[Sample]:
    header, truth = simulated.recording.header, simulated.truth
    images, files = simulated.image_files(robot), simulated.files
    for index, stamp_ns in enumerate(simulated.stamps_ns(robot)):
        facts = {
            "robot": robot,
            "stamp_ns": stamp_ns,
            "scene": header.scene,
            "seed": header.seed,
            "flight": header.flight,
            "camera": _camera(truth.lens(robot)),
            "T_world_camera": truth.T_world_camera(robot, stamp_ns).matrix().tolist(),
        }
        content = {"grey.png" if robot == "mav" else "colour.png": read_image_bytes(images[index])}
        if robot == "ground":
            content["depth.png"] = files.depth_png(index)
            depth = truth.calibration.ground.depth
            facts["depth_units_per_m"] = depth.units_per_m
            facts["depth_delay_ns"] = depth.delay_ns
        content["json"] = json.dumps(facts).encode()
        yield Sample(f"{robot}_{stamp_ns:019d}", content)


def _camera(lens: Lens) -> dict[str, Any]:
    """True intrinsics, distortion and shutter; integer pixel coordinates are pixel centres. With a
    rolling shutter the pose is that of the middle row."""
    return {
        "width": lens.width,
        "height": lens.height,
        "intrinsics": list(lens.intrinsics),
        "distortion_model": lens.model,
        "distortion_coefficients": list(lens.distortion),
        "readout_s": lens.readout_s,
    }
