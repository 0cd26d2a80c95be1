"""From what the user says to a validated configuration: preset, then file, then --set."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import tomli_w
from pydantic import BaseModel, Field, ValidationError

from airground.config import PRESETS, Config, Section
from airground.errors import ConfigError
from airground.io.input_files import parse_toml, read_toml_text
from evaluation.setup.setups import PoseNoise, Reference
from evaluation.setup.switches import switched_off

DEFAULT_PRESET = "best"

AnyConfig = TypeVar("AnyConfig", bound=Config)


class OracleErrors(Section):
    """Errors that are added to true poses (`--poses oracle`)."""

    drift_mav_cm: Annotated[float, Field(ge=0, le=100)] = 0.0
    """RMS of the MAV's slow position error after alignment [cm]; the paper measured 1.2."""
    drift_ground_cm: Annotated[float, Field(ge=0, le=100)] = 0.0
    """RMS of the ground robot's drift after alignment [cm]; the paper measured 3.8."""
    drift_mav_deg: Annotated[float, Field(ge=0, le=45)] = 0.0
    """RMS of the MAV's slow orientation error since its first image [deg]."""
    drift_ground_deg: Annotated[float, Field(ge=0, le=45)] = 0.0
    """RMS of the ground robot's orientation drift since its first image [deg]."""
    noise_mm: Annotated[float, Field(ge=0, le=1000)] = 0.0
    """White position noise per axis and frame [mm]."""
    noise_deg: Annotated[float, Field(ge=0, le=45)] = 0.0
    """White orientation noise per axis and frame [deg]."""

    def noise(self) -> PoseNoise:
        """The same in metres and degrees."""
        return PoseNoise(
            drift_mav_m=self.drift_mav_cm / 100,
            drift_ground_m=self.drift_ground_cm / 100,
            drift_mav_deg=self.drift_mav_deg,
            drift_ground_deg=self.drift_ground_deg,
            white_m=self.noise_mm / 1000,
            white_deg=self.noise_deg,
        )


class TrialReference(Section):
    """What the poses of refinement trials are compared with."""

    by: Literal["cameras", "paths"] = "cameras"
    """The true poses of both cameras, or alignments of both estimated paths with the true ones by
    positions alone, as by motion capture whose bodies are not calibrated against the cameras."""
    mav_camera_deg: Annotated[float, Field(ge=0, le=45)] = 0.0
    """Error of the calibration of the MAV's camera in its tracked body, per axis, constant over a
    flight [deg]."""
    ground_camera_deg: Annotated[float, Field(ge=0, le=45)] = 0.0
    """The same of the ground robot's camera [deg]."""

    def reference(self) -> Reference:
        """The same, as a part of a setup."""
        return Reference(self.by, self.mav_camera_deg, self.ground_camera_deg)


class ProtocolCounts(Section):
    """Amount measured on each flight, by `reproduce` and `sweep`; None for the verb's default."""

    sequences_per_flight: Annotated[int | None, Field(ge=1)] = None
    """Sequences of 12 aerial maps per flight, at most."""
    trials: Annotated[int | None, Field(ge=1)] = None
    """Refinements from a noisy start per flight."""
    baselines: Annotated[int | None, Field(ge=0)] = None
    """Number of these that every baseline is tried on as well; 0 for none."""
    only_images: bool | None = None
    """Whether only the baselines that match images are tried, as at level `paper`."""


RerunLevel = Literal["summary", "stages", "all"]


class RerunDetail(Section):
    """Contents of run.rrd, which `run --rerun` writes."""

    level: RerunLevel = "stages"
    """Detail of each second: docs/look_into_a_run.md has the sizes."""


class Settings(Config):
    """The pipeline's configuration, and the sections that only the evaluator reads."""

    oracle: OracleErrors = OracleErrors()
    reference: TrialReference = TrialReference()
    protocol: ProtocolCounts = ProtocolCounts()
    rerun: RerunDetail = RerunDetail()

    def pipeline(self) -> Config:
        """What the pipeline reads of it."""
        return Config.model_validate(self.model_dump(include=set(Config.model_fields)))


EVALUATOR_SECTIONS = tuple(
    name for name in Settings.model_fields if name not in Config.model_fields
)


def resolve(
    preset: str | None = None,
    file: Path | None = None,
    overrides: Sequence[str] = (),
    heading: str | None = None,
) -> Config:
    """The pipeline's configuration; arguments and errors as of `resolve_all`."""
    return resolve_all(preset, file, overrides, heading).pipeline()


def resolve_all(
    preset: str | None = None,
    file: Path | None = None,
    overrides: Sequence[str] = (),
    heading: str | None = None,
    sections: Sequence[str] = (),
    idle: Callable[[str, str], str] = lambda section, key: "",
    varied: Collection[str] = (),
) -> Settings:
    """All parameters that the command line asks for.

    Args:
        preset: A name in `PRESETS`; None for that of `file`, or else "best".
        file: TOML with any subset of the sections.
        overrides: "section.name=value", the value as in TOML; they win over the file.
        heading: Short for localization.heading, which `overrides` then lack; wins over the file.
        sections: Sections of `EVALUATOR_SECTIONS` that have a meaning here, among others.
        idle: Why a parameter (section, name) of `overrides` would change nothing; empty if it may.
            A file may have parameters that change nothing, so that one serves all verbs.
        varied: Parameters "section.name" to which a sweep gives several values.

    Raises:
        ConfigError: A name is unknown, a value is out of its range, or the file is no TOML; or
            one of `overrides` changes nothing, comes twice, or contradicts `heading`.
    """
    contents = _read(file) if file is not None else {}
    named = contents.pop("preset", None)
    if preset is not None and named not in (None, preset):
        raise ConfigError(f"{file}: is for preset {named!r}, but --preset says {preset!r}")
    name = preset or named or DEFAULT_PRESET
    if name not in PRESETS:
        raise ConfigError(f"unknown preset {name!r}; known: {', '.join(PRESETS)}")

    unused = set(EVALUATOR_SECTIONS) - set(sections)
    settings = Settings(**dict(PRESETS[name]()))
    for section, values in contents.items():
        if not isinstance(values, dict):
            known = _names(Settings, unused)
            raise ConfigError(f"{file}: {section!r} is no section; known: {known}")
        for key, value in values.items():
            settings = with_value(settings, section, key, value, str(file), unused)
    if heading is not None:
        settings = with_value(settings, "localization", "heading", heading, "--heading")
    seen: dict[str, str] = {}
    for override in overrides:
        section, key, value = _split(override)
        name, origin = f"{section}.{key}", f"--set {override}"
        if reason := idle(section, key):
            raise ConfigError(f"{origin}: {reason}")
        if heading is not None and name == "localization.heading":
            raise ConfigError(f"{origin}: --heading {heading} sets it as well; give one of the two")
        if name in seen:
            raise ConfigError(f"{origin}: {name} is given twice")
        seen[name] = origin
        settings = with_value(settings, section, key, value, origin, unused)
    for name, origin in seen.items():
        if reason := switched_off(settings, name, varied):
            raise ConfigError(f"{origin}: {reason}")
    return settings


def write_config(config: Config, path: Path) -> None:
    """Write every parameter; `--config` reads it back to the same configuration."""
    path.write_text(tomli_w.dumps(config.model_dump()), encoding="utf-8")


def _read(file: Path) -> dict[str, Any]:
    try:
        return read_toml_text(file)
    except OSError as error:
        raise ConfigError(f"--config {file}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(f"--config {file}: no TOML: {error}") from error


def _split(override: str) -> tuple[str, str, Any]:
    name, equals, text = override.partition("=")
    section, dot, key = name.strip().partition(".")
    if not (equals and dot and section and key):
        raise ConfigError(f"--set {override}: expected SECTION.NAME=VALUE")
    return section, key, parsed_value(text)


def parsed_value(text: str) -> Any:
    """A value as in TOML, or a word that needs no quotes here."""
    try:
        return parse_toml(f"value = {text}")["value"]
    except ValueError:
        return text.strip()


def with_value(
    config: AnyConfig, section: str, key: str, value: Any, origin: str, unused: Collection[str] = ()
) -> AnyConfig:
    """`config` with one value changed and validated.

    Raises:
        ConfigError: There is no such key, or the section is unused, or the value is out of its
            range; names `origin`.
    """
    is_section = section in type(config).model_fields and section not in unused
    part = getattr(config, section) if is_section else None
    if not isinstance(part, BaseModel):
        known = _names(type(config), unused)
        raise ConfigError(f"{origin}: unknown section {section!r}; known: {known}")
    if key not in type(part).model_fields:
        known = _names(type(part))
        raise ConfigError(f"{origin}: unknown key {section}.{key}; known: {known}")
    try:
        changed = type(part).model_validate({**part.model_dump(), key: value})
    except ValidationError as error:
        problem = error.errors()[0]["msg"]
        raise ConfigError(f"{origin}: {section}.{key} = {value!r}: {problem}") from error
    return config.model_copy(update={section: changed})


def _names(model: type[BaseModel], unused: Collection[str] = ()) -> str:
    return ", ".join(name for name in model.model_fields if name not in {"preset", *unused})
