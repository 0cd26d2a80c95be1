"""Options that several verbs share, in groups, and estimates of how long verbs take.

Nothing heavy is imported at the top of this file. A verb is a dataclass; each of its bases is a
group of options. An option is a field: its docstring is its help, and `Shown` says how the help
writes its value. Estimates are rough factors from an idle machine of 2022 with two cores
(docs/speed.md, docs/results.md), in seconds of one core per recorded second, unless stated.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from tyro.conf import UseAppendAction, arg

from airground.errors import InputError
from evaluation.commands import sections
from evaluation.setup.environment import usable_cores

if TYPE_CHECKING:
    from evaluation.setup.settings import Settings
    from evaluation.setup.setups import Setup

START_S = 20.0
"""Start of processes, compiled kernels from the cache, and the report [s]."""
RUN_S_PER_S = 0.6
"""Duration of `run` per recorded second, on two cores: 29 s for 52 s, and slower machines."""
TRACK_S_PER_S = 0.5
"""One front end over one robot's images: 15 ms per image at 30 Hz."""
RENDER_S_PER_S = 3.0
"""Images of both robots: 2 to 7 by the scene."""
MAV_RENDER_SHARE = 0.3
"""Share of the MAV's images in that: 0.28 with nominal sensors, 0.36 with real ones."""
MAV_MB_PER_S, GROUND_MB_PER_S = 6.0, 20.0
"""Images of each robot on the disk, without loss: noise of the sensors cannot be compressed."""
MEASURE_S_PER_S = 3.0
"""The paper's protocol with one kind of maps: 2 without baselines, 4 with all of them."""

ERRORS_OF_SLAM = "section oracle adds errors to true poses; give --poses oracle"


def on_disk(seconds: float, every: int = 1, only: str | None = None) -> str:
    """Size of a recording of so many seconds, with every n-th image of both robots or one, in
    words."""
    per_s = {"mav": MAV_MB_PER_S, "ground": GROUND_MB_PER_S}
    megabytes = sum(per_s.values()) if only is None else per_s[only]
    return in_megabytes(megabytes * seconds / every)


def render_s(seconds: float, every: int = 1, only: str | None = None) -> float:
    """Time of one core for the images of such a recording [s]."""
    shares = {None: 1.0, "mav": MAV_RENDER_SHARE, "ground": 1 - MAV_RENDER_SHARE}
    return shares[only] * RENDER_S_PER_S * seconds / every


def in_megabytes(megabytes: float) -> str:
    """A size, in words."""
    return f"about {megabytes / 1000:.1f} GB" if megabytes >= 1000 else f"about {megabytes:.0f} MB"


def work_s(core_s: float, cores: int) -> float:
    """Duration of work that is spread over cores [s]."""
    return START_S + core_s / max(1, cores)


def recorded(name: Path | str, seconds: float) -> str:
    """How messages name a recording: with its length."""
    return f"{name} ({seconds:.0f} s recorded)"


@dataclass(frozen=True)
class Shown:
    """How the help shows an option; an empty `default` stands for the field's own."""

    metavar: str
    default: str = ""


@dataclass(frozen=True, kw_only=True)
class Verb(ABC):
    """A verb of the command line; `heading` is that of a class's options in the help."""

    heading: ClassVar[str] = "machine"

    threads: Annotated[int | None, Shown("N", "one per core")] = None
    """threads and processes to use"""
    verbose: bool = False
    """log each step, and the traceback of an internal error"""
    log: Annotated[Path | None, Shown("FILE")] = None
    """add the log of each step to this file, with times"""

    def workers(self) -> int:
        """How many threads or processes to use."""
        return self.threads or usable_cores()

    @abstractmethod
    def main(self) -> int | None:
        """Do it; returns the exit code, None for 0."""


@dataclass(frozen=True, kw_only=True)
class OutOption:
    """Where results go."""

    heading: ClassVar[str] = "output"

    out: Annotated[Path, Shown("DIR")]
    """folder to make; it must not exist"""


@dataclass(frozen=True, kw_only=True)
class ResumableOutOption:
    """Where results go that may take long."""

    heading: ClassVar[str] = "output"

    out: Annotated[Path, Shown("DIR")]
    """folder to make; given again, an interrupted run is continued"""


@dataclass(frozen=True, kw_only=True)
class ClusterOption:
    """Which machines do the work."""

    heading: ClassVar[str] = "machine"

    cluster: Annotated[str | None, Shown("ADDRESS|FILE", "this machine")] = None
    """Dask scheduler or batch jobs (docs/sweep.md)"""


@dataclass(frozen=True, kw_only=True)
class SeedOption:
    """Where randomness comes from."""

    heading: ClassVar[str] = "input"

    seed: Annotated[int | None, Shown("N", "0")] = None
    """seed of everything random; the same seed gives the same result"""

    def checked_seed(self) -> int:
        """The seed, 0 if none is given; InputError if it is out of its range."""
        return int(in_range("--seed", self.seed or 0, low=0, high=2**63 - 1))


@dataclass(frozen=True, kw_only=True)
class SensorOption:
    """How good the sensors are."""

    heading: ClassVar[str] = "input"

    sensors: Annotated[
        Literal["none", "nominal", "harsh", "paper", "real"] | None,
        Shown("{none,nominal,harsh,paper,real}", "nominal"),
    ] = None
    """noise and calibration errors; paper: sensors of 2013; real: nominal ones with distortion,
    rolling shutters, automatic exposure"""

    def sensors_name(self) -> str:
        """The preset of the sensors, `nominal` if none is given."""
        return self.sensors or "nominal"


@dataclass(frozen=True, kw_only=True)
class ConfigOptions:
    """Parameters of the pipeline."""

    heading: ClassVar[str] = "pipeline"
    sections: ClassVar[tuple[str, ...]] = sections.PIPELINE
    """Sections of the configuration that the verb uses."""

    preset: Annotated[Literal["best", "paper", "paper_literal"] | None, Shown("NAME", "best")] = (
        None
    )
    """best, paper (as published), or paper_literal (sigma too)"""
    config: Annotated[Path | None, Shown("FILE")] = None
    """TOML file with any parameters (docs/parameters.md)"""
    overrides: Annotated[
        UseAppendAction[tuple[str, ...]], arg(name="set"), Shown("SECTION.NAME=VALUE")
    ] = ()
    """one parameter, as in localization.particles=400; repeatable"""

    def settings(self, heading: str | None = None) -> Settings:
        """All parameters that the options ask for.

        Raises:
            ConfigError: One is wrong, or `--set` gives one that would change nothing.
        """
        from evaluation.setup.settings import resolve_all

        return resolve_all(
            self.preset,
            self.config,
            self.overrides,
            heading,
            self.sections,
            self.idle,
            self.varied(),
        )

    def varied(self) -> tuple[str, ...]:
        """Parameters to which other options give several values."""
        return ()

    def idle(self, section: str, key: str) -> str:
        """Why a parameter would change nothing beside the other options; empty if it may."""
        verb = type(self).__name__.lower()
        return "" if section in self.sections else sections.unused(verb, section)

    def sets(self, name: str) -> bool:
        """Whether `--set` gives the parameter SECTION.NAME."""
        return any(word.partition("=")[0].strip() == name for word in self.overrides)


@dataclass(frozen=True, kw_only=True)
class PipelineOptions(ConfigOptions):
    """All that makes a setup: the pipeline's parameters and the source of the poses."""

    heading: ClassVar[str] = "pipeline"
    sections: ClassVar[tuple[str, ...]] = (*sections.PIPELINE, "oracle")

    poses: Literal["slam", "oracle"] = "slam"
    """own SLAM, or true poses with the errors of section oracle"""
    north: Annotated[
        Literal["known", "search"] | None, arg(name="heading"), Shown("{known,search}", "known")
    ] = None
    """from the magnetometers, or searched as a third dimension"""

    def settings(self, heading: str | None = None) -> Settings:
        return super().settings(heading or self.north)

    def idle(self, section: str, key: str) -> str:
        if section in sections.SLAM.values() and self.poses == "oracle":
            return "--poses oracle puts true poses in place of SLAM"
        if section == "oracle" and self.poses == "slam":
            return ERRORS_OF_SLAM
        return super().idle(section, key)

    def setup(self) -> Setup:
        """The setup.

        Raises:
            InputError: A parameter is out of its range, or errors are given for poses of SLAM.
        """
        from evaluation.setup.setups import EXACT, Reference, Setup

        settings = self.settings()
        noise = settings.oracle.noise()
        if self.poses == "slam" and noise != EXACT:
            raise InputError(ERRORS_OF_SLAM)
        reference = settings.reference.reference()
        if reference.by == "paths" and reference != Reference("paths"):
            raise InputError("reference.by=paths uses no calibration of cameras: give no errors")
        return Setup(settings.pipeline(), self.poses, noise, reference=reference)


def in_range(word: str, value: float, low: float = 0.0, high: float = math.inf) -> float:
    """`value`, if it lies within [low, high].

    Raises:
        InputError: It does not, or is no number.
    """
    if not (math.isfinite(value) and low <= value <= high):
        limits = f"at least {low:g}" if math.isinf(high) else f"from {low:g} to {high:g}"
        raise InputError(f"{word} {value:g}: must be {limits}")
    return value
