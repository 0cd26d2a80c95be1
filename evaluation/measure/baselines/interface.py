"""Input and answer of a baseline, without the truth, and a baseline's entry in the table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from airground.config import Config
from airground.core.arrays import read_only
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.core.sighting import Sighting


@dataclass(frozen=True, eq=False)
class View:
    """An image, and the camera that took it.

    Attributes:
        stamp_ns: Stamp of the image [ns].
        camera: Nominal intrinsics.
        T_map_camera: Pose in the robot's own map, by that robot's SLAM.
        grey: (height, width) uint8 image.
        depth: (height, width) float32 depth [m], NaN where missing; None without depth camera.
    """

    stamp_ns: int
    camera: PinholeCamera
    T_map_camera: SE3
    grey: NDArray[np.uint8]
    depth: NDArray[np.float32] | None = None

    def __post_init__(self) -> None:
        shape = (self.camera.height, self.camera.width)
        object.__setattr__(self, "grey", read_only(self.grey, "grey", shape, np.uint8))
        if self.depth is not None:
            object.__setattr__(self, "depth", read_only(self.depth, "depth", shape, np.float32))


@dataclass(frozen=True, eq=False)
class Given:
    """All that a baseline may use to answer one sighting.

    Attributes:
        sighting: Both maps at one time, and the heading by the magnetometers.
        config: Resolution, search region and thresholds of ours.
        rng: The only source of randomness.
        prior: Prior of T_ground_mav; None unless the baseline declares one.
        aerial_view: The MAV's reference image of the surface, its pose in `mav`; None unless
            the baseline declares views.
        ground_views: Images of the ground robot up to that time, their poses in `ground`; empty
            unless the baseline declares views.
    """

    sighting: Sighting
    config: Config
    rng: np.random.Generator
    prior: SE3 | None = None
    aerial_view: View | None = None
    ground_views: tuple[View, ...] = ()


@dataclass(frozen=True)
class Answer:
    """A baseline's estimate of the MAV's pose, and the reason why it is not claimed, if any."""

    T_ground_mav: SE3 | None
    refusal: str = ""

    def __post_init__(self) -> None:
        if self.T_ground_mav is None and not self.refusal:
            raise ValueError("an answer without a pose needs a reason")

    @property
    def claimed(self) -> bool:
        """Whether the baseline commits itself to the estimate."""
        return not self.refusal


Prior = Literal["none", "noisy", "truth"]
"""Prior that a baseline gets: none, the true relation with the trials' noise (0.2 m and 3 degrees
per axis, Sec. VIII-D), or the true relation itself, which makes it an oracle."""


@dataclass(frozen=True)
class Baseline:
    """One row of the table.

    Attributes:
        name: Name in its metrics; letters, digits and underscores.
        title: Name for readers.
        given: Its input, in words.
        locate: Answers one sighting; abstains by an answer, never by an exception.
        prior: Prior that it gets.
        views: Whether it gets both robots' images. The noisy prior selects those of the ground
            robot that are near, which saves it a search that ours has to do.
        module: Module that it imports from an extra; empty if none.
        install: How a user installs that.
        prepare: Loads what the first answer must not wait for; ImportError if it is not installed.
    """

    name: str
    title: str
    given: str
    locate: Callable[[Given], Answer]
    prior: Prior = "none"
    views: bool = False
    module: str = ""
    install: str = "pip install '.[baselines]'"
    prepare: Callable[[], object] | None = None
