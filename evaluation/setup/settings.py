"""From what the user says to a validated configuration: preset, then file, then --set."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import BaseModel, ValidationError

from airground.config import PRESETS, Config
from airground.errors import ConfigError

DEFAULT_PRESET = "best"


def resolve(
    preset: str | None = None,
    file: Path | None = None,
    overrides: Sequence[str] = (),
    heading: str | None = None,
) -> Config:
    """The configuration that the command line asks for.

    Args:
        preset: A name in `PRESETS`; None for that of `file`, or else "best".
        file: TOML with any subset of the configuration's sections.
        overrides: "section.name=value", the value as in TOML; they win over the file.
        heading: Short for localization.heading; wins over the file, not over `overrides`.

    Raises:
        ConfigError: A name is unknown, a value is out of its range, or the file is no TOML.
    """
    contents = _read(file) if file is not None else {}
    named = contents.pop("preset", None)
    if preset is not None and named not in (None, preset):
        raise ConfigError(f"{file}: is for preset {named!r}, but --preset says {preset!r}")
    name = preset or named or DEFAULT_PRESET
    if name not in PRESETS:
        raise ConfigError(f"unknown preset {name!r}; known: {', '.join(PRESETS)}")

    config = PRESETS[name]()
    for section, values in contents.items():
        if not isinstance(values, dict):
            raise ConfigError(f"{file}: {section!r} is no section; known: {_names(Config)}")
        for key, value in values.items():
            config = with_value(config, section, key, value, str(file))
    if heading is not None:
        config = with_value(config, "localization", "heading", heading, "--heading")
    for override in overrides:
        section, key, value = _split(override)
        config = with_value(config, section, key, value, f"--set {override}")
    return config


def write_config(config: Config, path: Path) -> None:
    """Write every parameter; `--config` reads it back to the same configuration."""
    path.write_text(tomli_w.dumps(config.model_dump()), encoding="utf-8")


def _read(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"--config {file}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
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
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()


def with_value(config: Config, section: str, key: str, value: Any, origin: str) -> Config:
    """`config` with one value changed and validated.

    Raises:
        ConfigError: There is no such key, or the value is out of its range; names `origin`.
    """
    part = getattr(config, section, None) if section in Config.model_fields else None
    if not isinstance(part, BaseModel):
        raise ConfigError(f"{origin}: unknown section {section!r}; known: {_names(Config)}")
    if key not in type(part).model_fields:
        known = _names(type(part))
        raise ConfigError(f"{origin}: unknown key {section}.{key}; known: {known}")
    try:
        changed = type(part).model_validate({**part.model_dump(), key: value})
    except ValidationError as error:
        problem = error.errors()[0]["msg"]
        raise ConfigError(f"{origin}: {section}.{key} = {value!r}: {problem}") from error
    return config.model_copy(update={section: changed})


def _names(model: type[BaseModel]) -> str:
    return ", ".join(name for name in model.model_fields if name != "preset")
