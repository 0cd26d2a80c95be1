"""What is varied: a setup is a configuration of the pipeline and a kind of poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from airground.config import Config, paper
from evaluation.results.condition import Condition
from evaluation.runs.given import NOTHING, Given
from evaluation.truth.pose_noise import EXACT, PoseNoise

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
    """

    config: Config
    poses: Poses = "slam"
    noise: PoseNoise = EXACT
    variant: str = ""
    given: Given = NOTHING

    def front_ends(self) -> dict[str, FrontEndName]:
        """Who tracks "mav" and "ground"."""
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
            variant=self.variant,
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
    """The primary setup first, then what the report shows beside it.

    Args:
        primary: What the user asked for.
        few: Only the true poses beside it, and the paper's constants with both readings of
            its sigma.
    """
    best, published = Config(), paper()
    minmax = with_localization(published, sigma_units="minmax")
    companions = [
        Setup(best, "oracle"),
        Setup(published),
        Setup(minmax, variant="sigma 0.08 of the cost scaled to [0, 1]"),
    ]
    if not few:
        companions += [Setup(best), Setup(with_localization(best, heading="search"))]
    known = (primary.config, primary.poses, primary.noise)
    return [primary, *(o for o in companions if (o.config, o.poses, o.noise) != known)]


def grouped_by_maps(setups: list[Setup]) -> list[list[Setup]]:
    """Setups that share their maps, together: mapping is the expensive part."""
    groups: list[list[Setup]] = []
    for setup in setups:
        for group in groups:
            if setup.maps_like(group[0]):
                group.append(setup)
                break
        else:
            groups.append([setup])
    return groups
