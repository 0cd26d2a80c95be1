"""Completion of verbs, options and their values in a shell, from the verbs themselves."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from tyro.conf import Positional

from evaluation.commands.help import Option, grouped_options
from evaluation.commands.options import Verb
from evaluation.commands.verbs import VERBS, verb_class

PROGRAM = "airground"
Shell = Literal["bash", "zsh", "fish"]


@dataclass(frozen=True, kw_only=True)
class Completion(Verb):
    """Print a script that completes verbs, options and their values in a shell.

    For bash: source <(airground completion bash), in ~/.bashrc. For zsh the same, in ~/.zshrc. For
    fish: airground completion fish > ~/.config/fish/completions/airground.fish.
    """

    shell: Positional[Shell]
    """shell that the script is for"""

    def main(self) -> None:
        verbs = {name: Completed.of(verb_class(name), text) for name, (_, text) in VERBS.items()}
        print(SCRIPTS[self.shell](verbs))


@dataclass(frozen=True)
class Completed:
    """What is completed after a verb: options "--name", and the values of those with choices."""

    text: str
    options: tuple[Option, ...]

    @classmethod
    def of(cls, verb: type[Verb], text: str) -> Completed:
        groups = grouped_options(verb).values()
        return cls(text, tuple(one for group in groups for one in group))

    def names(self) -> list[str]:
        return [_name(one) for one in self.options if not one.positional]

    def positionals(self) -> list[str]:
        """Words that may follow the verb itself."""
        return [word for one in self.options if one.positional for word in choices(one)]

    def with_choices(self) -> Iterator[tuple[str, list[str]]]:
        for one in self.options:
            if not one.positional and choices(one):
                yield _name(one), choices(one)


def choices(option: Option) -> list[str]:
    """The values that the form of an option lists: "--preset {best,paper}"."""
    listed = re.search(r"{(.+)}", option.form)
    return listed[1].split(",") if listed else []


def _name(option: Option) -> str:
    return option.form.split()[0]


def bash(verbs: Mapping[str, Completed]) -> str:
    """A function for bash's `complete`; what it does not know is completed as a file."""
    cases = [_bash_case(name, verb) for name, verb in verbs.items()]
    return "\n".join(
        [
            f"_{PROGRAM}() {{",
            '  local now="${COMP_WORDS[COMP_CWORD]}" before="${COMP_WORDS[COMP_CWORD-1]}" words=""',
            '  if [ "$COMP_CWORD" -eq 1 ]; then',
            f'    words="{" ".join(verbs)} --help --version"',
            "  else",
            '    case "${COMP_WORDS[1]}" in',
            *cases,
            "    esac",
            "  fi",
            '  COMPREPLY=($(compgen -W "$words" -- "$now"))',
            "}",
            f"complete -o default -F _{PROGRAM} {PROGRAM}",
        ]
    )


def _bash_case(name: str, verb: Completed) -> str:
    """The branch of a verb: an option's values after it, else options after a hyphen."""
    values = [f'{option}) words="{" ".join(of)}";;' for option, of in verb.with_choices()]
    options = f'case "$now" in -*) words="{" ".join([*verb.names(), "--help"])}";;'
    options += f' *) words="{" ".join(verb.positionals())}";; esac'
    return f'      {name}) case "$before" in {" ".join(values)} *) {options};; esac;;'


def zsh(verbs: Mapping[str, Completed]) -> str:
    """The script for bash, which zsh can run."""
    return f"autoload -U +X bashcompinit && bashcompinit\n{bash(verbs)}"


def fish(verbs: Mapping[str, Completed]) -> str:
    """Lines of fish's `complete`, with a text for each verb and option."""
    lines = []
    for name, verb in verbs.items():
        start = f"complete -c {PROGRAM}"
        lines.append(f"{start} -n __fish_use_subcommand -f -a {name} -d {shlex.quote(verb.text)}")
        after = f"{start} -n '__fish_seen_subcommand_from {name}'"
        if words := verb.positionals():
            lines.append(f"{after} -f -a {shlex.quote(' '.join(words))}")
        for one in verb.options:
            if one.positional:
                continue
            of = choices(one)
            value = f" -x -a {shlex.quote(' '.join(of))}" if of else " -r" * (" " in one.form)
            option = _name(one).removeprefix("--")
            lines.append(f"{after} -l {option}{value} -d {shlex.quote(one.text)}")
    return "\n".join(lines)


SCRIPTS: dict[Shell, Callable[[Mapping[str, Completed]], str]] = {
    "bash": bash,
    "zsh": zsh,
    "fish": fish,
}
