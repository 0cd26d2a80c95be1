"""What a shell completes."""

from __future__ import annotations

import subprocess

import pytest

from evaluation import cli
from evaluation.commands.completion import SCRIPTS, Completed, fish


def completed() -> dict[str, Completed]:
    return {name: Completed.of(cli.verb_class(name), text) for name, (_, text) in cli.VERBS.items()}


def in_bash(*words: str) -> list[str]:
    """What bash completes at the last of the words."""
    script = SCRIPTS["bash"](completed())
    quoted = " ".join(f"'{word}'" for word in words)
    ask = f"COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}; _airground"
    done = subprocess.run(
        ["bash", "-c", f'{script}\n{ask}; printf "%s\\n" "${{COMPREPLY[@]}}"'],
        capture_output=True,
        text=True,
        check=True,
    )
    assert not done.stderr
    return done.stdout.split()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["airground", "sim"], ["simulate"]),
        (["airground", "--ver"], ["--version"]),
        (["airground", "run", "--head"], ["--heading"]),
        (["airground", "run", "--heading", ""], ["known", "search"]),
        (["airground", "completion", "f"], ["fish"]),
        (["airground", "inspect", "recordings/"], []),  # bash goes on with files
    ],
)
def test_bash_completes_verbs_options_and_values(words: list[str], expected: list[str]) -> None:
    assert in_bash(*words) == expected


def test_every_option_is_completed() -> None:
    for name, verb in completed().items():
        assert set(verb.names()) <= set(in_bash("airground", name, "--"))


def test_fish_has_a_text_for_each_option() -> None:
    verbs = completed()
    lines = fish(verbs).splitlines()
    assert len([line for line in lines if "__fish_use_subcommand" in line]) == len(verbs)
    for name, verb in verbs.items():
        of_verb = [line for line in lines if f"from {name}'" in line and " -l " in line]
        assert len(of_verb) == len(verb.names())
        assert all(" -d " in line for line in of_verb)


def test_zsh_runs_the_script_for_bash(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.answer(["completion", "zsh"]) is None
    first, rest = capsys.readouterr().out.split("\n", 1)
    assert first.endswith("bashcompinit")
    assert rest.strip() == SCRIPTS["bash"](completed())
