"""From preset, file and overrides to one configuration."""

from __future__ import annotations

from pathlib import Path

import pytest

from airground.config import PRESETS, Config, paper
from airground.errors import ConfigError
from evaluation.setup.settings import resolve, write_config


def written(folder: Path, text: str) -> Path:
    file = folder / "mine.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_presets() -> None:
    assert resolve() == Config()
    assert resolve("best") == Config()
    assert resolve("paper") == paper()


def test_later_words_win(tmp_path: Path) -> None:
    file = written(tmp_path, "[localization]\nparticles = 300\nsigma = 0.5\n")
    config = resolve("paper", file, ["localization.particles=400"], heading="search")
    assert config.localization.particles == 400
    assert config.localization.sigma == 0.5
    assert config.localization.heading == "search"
    assert config.localization.cost == paper().localization.cost
    assert config.fusion == paper().fusion


@pytest.mark.parametrize("preset", PRESETS)
def test_a_written_configuration_is_read_back(preset: str, tmp_path: Path) -> None:
    config = resolve(preset, overrides=["fusion.voxels=[10, 20, 30]"])
    write_config(config, tmp_path / "config.toml")
    assert resolve(file=tmp_path / "config.toml") == config


def test_values_are_toml_and_words_need_no_quotes() -> None:
    overrides = ["localization.cost=zmssd", "height_maps.dilate_holes=false", "fusion.bins = 4"]
    config = resolve(overrides=overrides)
    assert config.localization.cost == "zmssd"
    assert config.height_maps.dilate_holes is False
    assert config.fusion.bins == 4


@pytest.mark.parametrize(
    ("override", "named"),
    [
        ("localization.sgima=1", "unknown key localization.sgima; known: cost, patch_m, sigma"),
        ("localisation.sigma=1", "unknown section 'localisation'; known: monocular_slam"),
        ("preset=paper", "expected SECTION.NAME=VALUE"),
        ("localization.sigma", "expected SECTION.NAME=VALUE"),
        ("localization.min_overlap=2", "localization.min_overlap = 2"),
        ("fusion.truncation_m=-1", "greater than 0"),
        ("fusion.voxels=[1, 2]", "fusion.voxels"),
        ("localization.cost=ssd", "'zmssd', 'ncc', 'likelihood' or 'channels'"),
        ("preset.name=1", "unknown section 'preset'"),
    ],
)
def test_wrong_overrides_are_named(override: str, named: str) -> None:
    with pytest.raises(ConfigError) as error:
        resolve(overrides=[override])
    assert named in str(error.value)
    assert override in str(error.value)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("[localization\n", "no TOML"),
        ("[nowhere]\na = 1\n", "unknown section 'nowhere'"),
        ("sigma = 1\n", "'sigma' is no section"),
        ('preset = "worst"\n', "unknown preset 'worst'; known: best, paper"),
        ("[fusion]\nbins = 0\n", "fusion.bins = 0"),
    ],
)
def test_wrong_files_are_named(text: str, named: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as error:
        resolve(file=written(tmp_path, text))
    assert named in str(error.value)


def test_missing_file_and_contradicting_presets(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="No such file"):
        resolve(file=tmp_path / "none.toml")
    file = written(tmp_path, 'preset = "paper"\n')
    assert resolve(file=file) == paper()
    with pytest.raises(ConfigError, match="is for preset 'paper'"):
        resolve("best", file)


def test_a_value_nested_without_end_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"localization\.particles"):
        resolve(overrides=["localization.particles=" + "[" * 50_000])
