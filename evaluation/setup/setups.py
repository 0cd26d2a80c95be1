"""What is varied: a setup is a configuration of the pipeline, a kind of poses, given results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from airground.config import Config, paper, paper_literal
from airground.core.cloud import PointCloud
from airground.core.trajectory import Trajectory
from evaluation.setup.condition import Condition


@dataclass(frozen=True)
class PoseNoise:
    """How wrong an oracle's poses are.

    Attributes:
        drift_mav_m: RMS of the MAV's slow position error after SE3 alignment [m].
        drift_ground_m: RMS of the ground robot's drift after SE3 alignment [m].
        drift_mav_deg: RMS of the MAV's slow orientation error since the first image [deg].
        drift_ground_deg: RMS of the ground robot's orientation drift since the first image [deg].
        white_m: Standard deviation of independent position noise per axis and frame [m].
        white_deg: The same of the orientation, per axis [deg].
    """

    drift_mav_m: float = 0.0
    drift_ground_m: float = 0.0
    drift_mav_deg: float = 0.0
    drift_ground_deg: float = 0.0
    white_m: float = 0.0
    white_deg: float = 0.0


EXACT = PoseNoise()
PAPER_DRIFT = PoseNoise(drift_mav_m=0.012, drift_ground_m=0.038)
"""What the paper measured for its SLAM (Fig. 9, 10)."""


@dataclass(frozen=True)
class Reference:
    """What the poses of refinement trials are compared with.

    Attributes:
        by: "cameras": the true poses of both cameras. "paths": the rigid alignments of both
            estimated paths with the true ones, by positions alone.
        mav_camera_deg, ground_camera_deg: With "cameras": standard deviation per axis of an error
            of each camera's orientation in the tracked body, drawn once per flight [deg].
    """

    by: Literal["cameras", "paths"] = "cameras"
    mav_camera_deg: float = 0.0
    ground_camera_deg: float = 0.0

    def describe(self) -> str:
        """How results name it; empty for the true poses."""
        if self.by == "paths":
            return "refinement against aligned paths"
        if self == TRUE_POSES:
            return ""
        sizes = f"{self.mav_camera_deg:g} and {self.ground_camera_deg:g} deg"
        return f"refinement against cameras turned by {sizes} (MAV, ground)"


TRUE_POSES = Reference()


@dataclass(frozen=True, eq=False)
class Given:
    """Results of other systems; None where ours do the work.

    Attributes:
        mav, ground: Poses `T_map_camera`, metric with z up.
        ground_map: In the frame of the ground robot's poses.
    """

    mav: Trajectory | None = None
    ground: Trajectory | None = None
    ground_map: PointCloud | None = None

    def robots(self) -> frozenset[str]:
        """Those of "mav" and "ground" whose poses are given."""
        poses = {"mav": self.mav, "ground": self.ground}
        return frozenset(robot for robot, given in poses.items() if given is not None)

    def describe(self) -> str:
        """How results name what was replaced; empty where nothing was."""
        parts = {"MAV poses": self.mav, "ground poses": self.ground, "ground map": self.ground_map}
        names = [name for name, given in parts.items() if given is not None]
        return f"{', '.join(names)} from a file" if names else ""


NOTHING = Given()

Poses = Literal["slam", "oracle", "slam, exact mav", "slam, exact ground"]
"""Where poses come from: each robot's own SLAM, or the truth for both or one of them."""

FrontEndName = Literal["slam", "oracle", "file"]
"""Who tracks a robot: its own SLAM, the truth, or a trajectory that the user brought along."""

ROBOTS = {"mav", "ground"}


@dataclass(frozen=True)
class Setup:
    """One column of the report.

    Attributes:
        config: The pipeline's parameters.
        poses: Where the cameras' poses come from.
        noise: What was added to the oracle's poses.
        variant: What else differs from the preset, in words.
        given: What the user brings along in place of a stage.
        reference: What the poses of refinement trials are compared with.
    """

    config: Config
    poses: Poses = "slam"
    noise: PoseNoise = EXACT
    variant: str = ""
    given: Given = NOTHING
    reference: Reference = TRUE_POSES

    def front_ends(self) -> dict[str, FrontEndName]:
        """The front end of "mav" and of "ground"."""
        oracles = {"oracle": ROBOTS, "slam, exact mav": {"mav"}, "slam, exact ground": {"ground"}}
        way: dict[str, FrontEndName] = dict.fromkeys(ROBOTS, "slam")
        way |= dict.fromkeys(oracles.get(self.poses, set()), "oracle")
        return way | dict.fromkeys(self.given.robots(), "file")

    def slam_robots(self) -> frozenset[str]:
        """Those of "mav" and "ground" whose poses come from SLAM."""
        return frozenset(robot for robot, way in self.front_ends().items() if way == "slam")

    def needs_truth(self) -> bool:
        """Whether any robot's poses come from an oracle."""
        return "oracle" in self.front_ends().values()

    def condition(self, sensors: str) -> Condition:
        """How results name this setup."""
        poses: str = self.poses
        if poses == "oracle":
            poses = "oracle exact" if self.noise == EXACT else "oracle with drift"
        return Condition(
            preset=self.config.preset,
            poses=poses,
            sensors=sensors,
            heading=self.config.localization.heading,
            variant=", ".join(filter(None, (self.variant, self.reference.describe()))),
        )

    def maps_like(self, other: Setup) -> bool:
        """Whether both make the same maps: only what comes after may differ."""
        unused = {"preset", "height_maps", "localization", "refinement"}
        if self.poses == "oracle":
            unused |= {"monocular_slam", "rgbd_slam"}
        mine, theirs = (s.config.model_dump(exclude=unused) for s in (self, other))
        return mine == theirs and (self.poses, self.noise) == (other.poses, other.noise)


def with_localization(config: Config, **changes: object) -> Config:
    """`config` with some parameters of Monte Carlo localization changed, and validated."""
    localization = {**config.localization.model_dump(), **changes}
    return Config.model_validate({**config.model_dump(), "localization": localization})


def with_companions(primary: Setup, few: bool = False) -> list[Setup]:
    """The primary setup, then what the report shows beside it.

    `best` stands beside the paper's constants in both readings of sigma, and the reverse; unless
    `few`, `best` also beside itself with true poses and with a searched heading.
    """
    best, published, literal = Setup(Config()), Setup(paper()), Setup(paper_literal())
    if primary.config.preset != "best":
        companions = [literal, best, published]
    else:
        companions = [Setup(Config(), "oracle"), published, literal]
        if not few:
            companions += [best, Setup(with_localization(Config(), heading="search"))]
    known = (primary.config, primary.poses, primary.noise)
    return [primary, *(o for o in companions if (o.config, o.poses, o.noise) != known)]
