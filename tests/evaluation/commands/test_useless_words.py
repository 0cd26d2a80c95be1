"""Words that would change nothing are refused, with the reason."""

from __future__ import annotations

from pathlib import Path

import pytest

from airground.config import Config
from airground.errors import InputError
from evaluation import cli
from evaluation.commands.options import ConfigOptions
from evaluation.commands.reproduce import Reproduce
from evaluation.commands.sections import PIPELINE, USED
from evaluation.commands.sweep import Sweep
from evaluation.commands.verbs import VERBS, verb_class
from evaluation.setup import console
from evaluation.setup.settings import EVALUATOR_SECTIONS, Settings, with_value, write_config
from evaluation.setup.switches import SWITCH_OF, switched_off

OTHER_WORDS = {
    "localization.heading": "known",
    "localization.cost": "ncc",
    "localization.estimate": "mean",
    "plane_sweep.smoothing": "none",
}

USELESS = {
    "bench --recording R --sensors real": "--sensors real: of the recording that bench makes",
    "bench --recording R --seed 0": "--seed 0: of the recording that bench makes",
    "simulate --level hard --sensors nominal": "--level hard: fixes all but",
    "simulate tiny --seeds 1-3 --seed 0": "no --seed",
    "track R --robot mav --set localization.particles=9": (
        "track does not use section localization, which is of: run, live, reproduce, sweep"
    ),
    "track R --robot mav --set rerun.level=all": "track does not use section rerun",
    "track R --robot mav --set rgbd_slam.corners=9": "of this robot uses section monocular_slam",
    "track R --robot ground --set monocular_slam.corners=9": "uses section rgbd_slam",
    "track R --robot ground --front-end opencv --set rgbd_slam.corners=9": "is opencv",
    "track R --robot ground --front-end opencv --preset paper": "--preset paper: only slam",
    "track R --robot ground --trajectory T --config C": "--config C: only slam",
    "track R --robot mav --depth-scale 1000": "--depth-scale: the MAV has no depth images",
    "run R --set rerun.level=all": "--set rerun.level=all: nothing is drawn without --rerun",
    "run R --set reference.by=paths": "run does not use section reference",
    "run R --poses oracle --set rgbd_slam.corners=9": "--poses oracle puts true poses in place",
    "run R --set oracle.noise_mm=0": "give --poses oracle",
    "run R --mav-trajectory T --set monocular_slam.corners=9": "T is given in place of this stage",
    "run R --ground-trajectory T --set rgbd_slam.corners=9": "T is given in place of this stage",
    "run R --ground-trajectory T --ground-map M --set ground_mapping.max_depth_m=9": (
        "M is given in place of this stage"
    ),
    "run R --heading search --set localization.heading=known": (
        "--set localization.heading=known: --heading search sets it as well; give one of the two"
    ),
    "live R --heading known --set localization.heading=search": "--heading known sets it as well",
    "live R --set fusion.bins=4 --set fusion.bins=5": "--set fusion.bins=5: fusion.bins is given",
    "live R --set rerun.level=all": "live does not use section rerun, which is of: run",
    "reproduce --suite fast --alone": "--alone: the suite fast has one setup anyway; leave it out",
    "reproduce --suite hard --sensors real": "--sensors: the suite hard fixes it",
    "reproduce --suite hard --heading known": "--heading: the suite hard fixes it",
    "reproduce --suite faults --set localization.heading=search": "the suite faults fixes it",
    "reproduce --set rerun.level=all": "reproduce does not use section rerun",
    "reproduce --level hard --set localization.heading=search": "level hard fixes it",
    "reproduce --level hard --set localization.heading=known": "level hard fixes it",
    "run R --set localization.headings=90": (
        "--set localization.headings=90: localization.headings changes nothing without "
        "localization.heading=search"
    ),
    "run R --preset paper --set localization.patch_m=0.2": (
        "without localization.cost=likelihood or channels"
    ),
    "live R --set refinement.local_search=false --set refinement.local_search_radius_m=1": (
        "changes nothing without refinement.local_search=true"
    ),
    "reproduce --suite fast --set localization.headings=90": "without localization.heading=search",
    "reproduce --level easy --set localization.headings=90": "without localization.heading=search",
    "sweep --vary localization.headings=90,180": "without localization.heading=search",
    "run R --set plane_sweep.smoothing=none --set plane_sweep.step_penalty=1": (
        "changes nothing without plane_sweep.smoothing=semiglobal"
    ),
    "sweep --vary rgbd_slam.corners=9,10 --poses oracle": "--poses oracle puts true poses in place",
    "sweep --vary fusion.bins=4,5 --set fusion.bins=6": "--set fusion.bins: --vary gives its value",
    "sweep --vary localization.heading=known,search --heading known": "--heading: --vary gives its",
}


@pytest.mark.parametrize("words", USELESS)
def test_a_word_that_changes_nothing_gets_one_line(
    words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before an input is read: there is none."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        cli.main([*words.split(), "--out", "out"])
    assert ended.value.code == console.EXIT_ERROR
    (line,) = capsys.readouterr().err.splitlines()
    assert USELESS[words] in line
    assert list(tmp_path.iterdir()) == []


def settings_of(words: str) -> Settings:
    verb, *rest = words.split()
    parsed = cli.parse(verb, [*rest, "--out", "out"])
    assert isinstance(parsed, ConfigOptions)
    return parsed.settings(getattr(parsed, "north", None))


def test_the_same_words_where_they_change_something() -> None:
    track = "track R --robot ground"
    assert settings_of(f"{track} --set rgbd_slam.corners=9").rgbd_slam.corners == 9
    both = f"{track} --front-end opencv slam --preset paper --set rgbd_slam.corners=9"
    assert settings_of(both).rgbd_slam.corners == 9
    for rerun in ("--rerun", "--rerun-live"):
        assert settings_of(f"run R {rerun} --set rerun.level=all").rerun.level == "all"
    given = "run R --mav-trajectory T --set rgbd_slam.corners=9"
    assert settings_of(given).rgbd_slam.corners == 9
    mapped = "run R --ground-trajectory T --ground-map M --set ground_mapping.voxel_m=0.03"
    assert settings_of(mapped).ground_mapping.voxel_m == 0.03
    oracle = "live R --poses oracle --set oracle.noise_mm=2"
    assert settings_of(oracle).oracle.noise_mm == 2
    search = "run R --heading search --set localization.headings=90"
    assert settings_of(search).localization.heading == "search"
    ordered = "live R --set localization.headings=90 --set localization.heading=search"
    assert settings_of(ordered).localization.headings == 90


def test_a_file_serves_every_verb(tmp_path: Path) -> None:
    """It may hold parameters that a verb does not use: a run writes all of them."""
    write_config(Config(), tmp_path / "config.toml")
    for words in ("track R --robot mav", "run R --poses oracle", "live R --heading search"):
        made = settings_of(f"{words} --config {tmp_path / 'config.toml'}")
        assert made.fusion == Config().fusion


def test_a_sweep_varies_what_another_option_leaves_open(tmp_path: Path) -> None:
    swept = Sweep(
        vary=("localization.particles=50,80",), out=tmp_path, poses="oracle", north="search"
    )
    assert len(swept.plan().points()) == 2
    headings = Sweep(
        vary=("localization.heading=known,search",),
        overrides=("localization.headings=90",),
        out=tmp_path,
    )
    assert len(headings.plan().points()) == 2


def test_a_level_and_a_suite_switch_on_what_searches_headings() -> None:
    for words in ("--level hard", "--suite hard"):
        parsed = cli.parse(
            "reproduce", [*words.split(), "--set", "localization.headings=90", "--out", "out"]
        )
        assert isinstance(parsed, Reproduce)
        plan = parsed.plan() if parsed.suite is None else parsed.suite_plan(parsed.suite)
        assert plan.setups[0].config.localization.headings == 90


def test_every_switch_is_a_parameter_that_can_be_off() -> None:
    for name, (switch, on) in SWITCH_OF.items():
        section, _, key = switch.partition(".")
        for other in (name, switch):
            part, _, field = other.partition(".")
            assert field in type(getattr(Config(), part)).model_fields
        off = not on if isinstance(on, bool) else OTHER_WORDS[switch]
        config = with_value(Config(), section, key, off, "test")
        assert switched_off(config, name).startswith(f"{name} changes nothing without {switch}=")
        assert switched_off(config, name, [switch]) == ""
        for value in on if isinstance(on, tuple) else (on,):
            assert switched_off(with_value(config, section, key, value, "test"), name) == ""


def test_the_sections_that_each_verb_uses() -> None:
    """The table has every verb with a configuration, and every section."""
    with_sections = {
        name: verb.sections for name in VERBS if issubclass(verb := verb_class(name), ConfigOptions)
    }
    assert with_sections == USED
    assert {*PIPELINE, "preset"} == set(Config.model_fields)
    assert set().union(*USED.values()) == {*PIPELINE, *EVALUATOR_SECTIONS}


@pytest.mark.parametrize(
    "words", ["--calibration x.yaml", "--depth-scale 1000", "--topics image=/a"]
)
def test_a_recording_that_states_all_needs_no_options(
    words: str, small: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No finding of `inspect` either: the recording is not at fault."""
    with pytest.raises(SystemExit) as ended:
        cli.main(["inspect", str(small), *words.split()])
    assert ended.value.code == console.EXIT_ERROR
    said = capsys.readouterr()
    assert said.out == ""
    assert str(small) in said.err


def test_only_a_known_section_has_verbs() -> None:
    with pytest.raises(InputError, match="unknown section 'localisation'"):
        settings_of("track R --robot mav --set localisation.particles=9")
