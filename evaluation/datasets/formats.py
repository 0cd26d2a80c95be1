"""The formats by name: a literal table.
To add one, write a function that fills an empty folder, and put a line here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from airground.errors import InputError
from evaluation.datasets.colmap import write_colmap_folder
from evaluation.datasets.euroc import write_euroc_folder
from evaluation.datasets.mcap import write_bag
from evaluation.datasets.nerfstudio import write_nerfstudio_folder
from evaluation.datasets.simulated import Simulated
from evaluation.datasets.tum import write_tum_folder
from evaluation.datasets.views import EVERY
from evaluation.datasets.webdataset import write_webdataset
from sim.robots.motion import ROBOTS, Robot

Robots = tuple[Robot, ...]


@dataclass(frozen=True)
class Format:
    """A format that recordings are exported to.

    Attributes:
        write: Function that fills an empty folder.
        usual, possible: Robots that it holds by default, and those that it can hold.
        because: Reason why it holds no other robots.
        every: Step between the images that it holds.
        depth: Whether it holds the ground robot's depth.
    """

    write: Callable[[Path, Simulated, Robots], None]
    usual: Robots
    possible: tuple[Robots, ...]
    because: str = ""
    every: int = 1
    depth: bool = True

    def expected_mb(self, simulated: Simulated, robots: Robots) -> float:
        """Size of the images that are written [MB]: nearly all of an export. Depth that MCAP
        compresses itself is about as large as the recording's."""
        files = simulated.files
        written = [file for robot in robots for file in simulated.image_files(robot)[:: self.every]]
        if self.depth and "ground" in robots:
            written += files.ground_depth_files[:: self.every]
        return sum(file.stat().st_size for file in written) / 1e6


MAV: Robots = ("mav",)
GROUND: Robots = ("ground",)

FORMATS = {
    "tum": Format(write_tum_folder, GROUND, (GROUND,), "every image needs its depth"),
    "euroc": Format(write_euroc_folder, MAV, (MAV,), "it has no depth images"),
    "mcap": Format(write_bag, ROBOTS, (ROBOTS, MAV, GROUND)),
    "nerfstudio": Format(
        write_nerfstudio_folder,
        GROUND,
        (GROUND, MAV),
        "one transforms.json is of one camera: give --robot mav or --robot ground",
        every=EVERY,
    ),
    "colmap": Format(write_colmap_folder, ROBOTS, (ROBOTS, MAV, GROUND), every=EVERY, depth=False),
    "webdataset": Format(write_webdataset, ROBOTS, (ROBOTS, MAV, GROUND)),
}


def robots_for(name: str, asked: str | None) -> Robots:
    """The robots that go into a format, as asked ("mav", "ground" or "both") or by default.

    Raises:
        InputError: The format cannot hold them.
    """
    chosen = FORMATS[name]
    by_word = {None: chosen.usual, "both": ROBOTS, "mav": MAV, "ground": GROUND}
    robots = by_word[asked]
    if robots not in chosen.possible:
        raise InputError(f"--robot {asked}: not with --format {name}: {chosen.because}")
    return robots


def robots_in(simulated: Simulated, name: str, asked: str | None) -> Robots:
    """As `robots_for`; by default the one robot of a recording that has no other.

    Raises:
        InputError: The format cannot hold them, or one was not recorded.
    """
    robots, there = robots_for(name, asked), simulated.robots
    if asked is None and len(there) == 1 and there in FORMATS[name].possible:
        return there
    simulated.check_recorded(robots)
    return robots
