"""What is varied: a setup is a configuration of the pipeline and a kind of poses."""

from __future__ import annotations

from dataclasses import dataclass

from airground.config import Config, paper
from evaluation.oracle import EXACT, PAPER_DRIFT, PoseNoise
from evaluation.results import Condition


@dataclass(frozen=True)
class Setup:
    """One column of the report.

    Attributes:
        config: The pipeline's parameters.
        noise: What was added to the oracle's poses.
        variant: What else differs from the preset, in words.
    """

    config: Config
    noise: PoseNoise = EXACT
    variant: str = ""

    def condition(self, sensors: str) -> Condition:
        """How results name this setup."""
        return Condition(
            preset=self.config.preset,
            poses="oracle exact" if self.noise == EXACT else "oracle with drift",
            sensors=sensors,
            heading=self.config.localization.heading,
            variant=self.variant,
        )

    def maps_like(self, other: Setup) -> bool:
        """Whether both make the same maps: only what comes after may differ."""
        after = {"preset", "localization", "refinement"}
        mine, theirs = (s.config.model_dump(exclude=after) for s in (self, other))
        return mine == theirs and self.noise == other.noise


def with_localization(config: Config, **changes: object) -> Config:
    """`config` with some parameters of Monte Carlo localization changed, and validated."""
    localization = {**config.localization.model_dump(), **changes}
    return Config.model_validate({**config.model_dump(), "localization": localization})


def with_companions(primary: Setup, few: bool = False) -> list[Setup]:
    """The primary setup first, then what the report shows beside it.

    Args:
        primary: What the user asked for.
        few: Only the paper's constants beside it, with both readings of its sigma.
    """
    best, published = Config(), paper()
    companions = [
        Setup(published),
        Setup(
            with_localization(published, sigma_units="minmax"),
            variant="sigma 0.08 of the cost scaled to [0, 1]",
        ),
    ]
    if not few:
        companions += [
            Setup(best),
            Setup(best, PAPER_DRIFT),
            Setup(with_localization(best, heading="search")),
        ]
    known = (primary.config, primary.noise)
    return [primary, *(other for other in companions if (other.config, other.noise) != known)]


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
