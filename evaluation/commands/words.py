"""Words that several verbs share. Nothing heavy may be imported at the top of this file."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import UseAppendAction, arg

from airground.errors import InputError
from evaluation.setup.environment import usable_cores

if TYPE_CHECKING:
    from airground.config import Config
    from evaluation.setup.setups import PoseNoise, Setup


@dataclass(frozen=True, kw_only=True)
class Verb(ABC):
    """A verb of the command line."""

    verbose: bool = False
    """Say what is done at each step."""
    threads: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: one a core)")] = (
        None
    )
    """Threads and processes to use."""

    def workers(self) -> int:
        """How many threads or processes to use."""
        return self.threads or usable_cores()

    @abstractmethod
    def main(self) -> int | None:
        """Do it; returns the exit code, None for 0."""


@dataclass(frozen=True, kw_only=True)
class OutWord:
    """Where results go."""

    out: Annotated[Path, arg(metavar="DIR")]
    """Folder to make; it must not exist."""


@dataclass(frozen=True, kw_only=True)
class ResumableOutWord:
    """Where results go that may take long."""

    out: Annotated[Path, arg(metavar="DIR")]
    """Folder to make; given again, the run goes on where it stopped, whatever stopped it."""


@dataclass(frozen=True, kw_only=True)
class ClusterWord:
    """Who does the work."""

    cluster: Annotated[
        str | None,
        arg(metavar="tcp://HOST:PORT|FILE.yaml", help_behavior_hint="(default: this machine)"),
    ] = None
    """A Dask scheduler that is there, or jobs of a batch system (docs/sweep.md)."""


@dataclass(frozen=True, kw_only=True)
class SeedWord:
    """Where randomness comes from."""

    seed: int = 0
    """Seed of all that is random; the same seed gives the same result."""

    def checked_seed(self) -> int:
        return int(in_range("--seed", self.seed, low=0, high=2**63 - 1))


@dataclass(frozen=True, kw_only=True)
class PipelineWords:
    """How the pipeline is set."""

    preset: Annotated[
        Literal["paper", "best"] | None,
        arg(metavar="{paper,best}", help_behavior_hint="(default: that of --config, or best)"),
    ] = None
    """The constants as published, or ours."""
    heading: Annotated[
        Literal["known", "search"] | None,
        arg(metavar="{known,search}", help_behavior_hint="(default: known)"),
    ] = None
    """Heading from the magnetometers, or searched as a third dimension."""
    config: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(optional)")] = None
    """TOML with any of the parameters in a config.toml."""
    overrides: Annotated[
        UseAppendAction[tuple[str, ...]],
        arg(name="set", metavar="SECTION.NAME=VALUE", help_behavior_hint="(repeatable)"),
    ] = ()
    """One parameter, as in localization.particles=400; wins over --config."""

    def resolved_config(self) -> Config:
        from evaluation.setup.settings import resolve

        return resolve(self.preset, self.config, self.overrides, self.heading)


@dataclass(frozen=True, kw_only=True)
class PoseWords:
    """Where the poses of both cameras come from, and what is added to them."""

    poses: Literal["slam", "oracle"] = "slam"
    """Each robot's own SLAM, or the true poses with the errors stated below."""
    drift_mav_cm: Annotated[float, arg(metavar="CM")] = 0.0
    """Oracle: RMS of the MAV's slow position error after alignment; the paper measured 1.2."""
    drift_ground_cm: Annotated[float, arg(metavar="CM")] = 0.0
    """Oracle: RMS of the ground robot's drift after alignment; the paper measured 3.8."""
    pose_noise_mm: Annotated[float, arg(metavar="MM")] = 0.0
    """Oracle: white position noise per axis and frame."""
    pose_noise_deg: Annotated[float, arg(metavar="DEG")] = 0.0
    """Oracle: white orientation noise per axis and frame."""

    def pose_noise(self) -> PoseNoise:
        """What is added to the oracle's poses.

        Raises:
            InputError: A number is out of range, or there is no oracle to add it to.
        """
        from evaluation.setup.setups import EXACT, PoseNoise

        noise = PoseNoise(
            drift_mav_m=in_range("--drift-mav-cm", self.drift_mav_cm, high=100) / 100,
            drift_ground_m=in_range("--drift-ground-cm", self.drift_ground_cm, high=100) / 100,
            white_m=in_range("--pose-noise-mm", self.pose_noise_mm, high=1000) / 1000,
            white_deg=in_range("--pose-noise-deg", self.pose_noise_deg, high=45),
        )
        if self.poses == "slam" and noise != EXACT:
            raise InputError("drift and pose noise are added to true poses; give --poses oracle")
        return noise


@dataclass(frozen=True, kw_only=True)
class SetupWords(PipelineWords, PoseWords):
    """All that makes a setup: the pipeline's parameters and the poses."""

    def setup(self) -> Setup:
        from evaluation.setup.setups import Setup

        return Setup(self.resolved_config(), self.poses, self.pose_noise())


@dataclass(frozen=True, kw_only=True)
class SensorWord:
    """How good the sensors are."""

    sensors: Literal["none", "nominal", "harsh"] = "nominal"
    """No noise, that of the paper's kind of sensors, or worse."""


def in_range(word: str, value: float, low: float = 0.0, high: float = math.inf) -> float:
    """`value`, if it lies within [low, high].

    Raises:
        InputError: It does not, or is no number.
    """
    if not (math.isfinite(value) and low <= value <= high):
        limits = f"at least {low:g}" if math.isinf(high) else f"from {low:g} to {high:g}"
        raise InputError(f"{word} {value:g}: must be {limits}")
    return value
