"""The command `airground`: picks the verb, reads its options, runs it.

A verb is a dataclass in `evaluation.commands`. Only the verb that was asked for is imported, and
heavy imports wait for its `main()`, so that `--help` answers at once.
"""

from __future__ import annotations

import contextlib
import difflib
import io
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from airground import __version__
from evaluation.commands.verbs import JOBS, VERBS, verb_class
from evaluation.setup import console, progress
from evaluation.setup.environment import prepare

if TYPE_CHECKING:
    from evaluation.commands.options import Verb


def main(arguments: Sequence[str] | None = None) -> None:
    """Entry point; ends the process with the verb's exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    sys.exit(console.run(lambda: answer(words), "--verbose" in words))


def answer(words: list[str]) -> int | None:
    """Do what the words ask for; returns the exit code, None for 0."""
    if not words or words[0] in ("-h", "--help"):
        print(overview())
        return console.EXIT_OK if words else console.EXIT_ERROR
    if words[0] == "--version":
        print(f"airground {__version__}")
        return console.EXIT_OK
    name, *rest = words
    if name not in VERBS:
        meant = _nearest(name, VERBS)
        console.print_error(f"unknown verb {name!r};{meant} known: {', '.join(VERBS)}")
        return console.EXIT_ERROR
    if "-h" in rest or "--help" in rest:
        from evaluation.commands.help import help_text

        print(help_text(name, verb_class(name)))
        return console.EXIT_OK
    return carry_out(parse(name, rest))


def carry_out(verb: Verb) -> int | None:
    """Settle threads, rendering and logging, then do what the verb does."""
    prepare(verb.threads)
    console.start_logging(verb.verbose, verb.log)
    with progress.shown():
        return verb.main()


def overview() -> str:
    """What `airground --help` prints."""
    width = max(map(len, VERBS))
    lines = [
        "usage: airground VERB [OPTIONS]",
        "",
        "Locate a drone in a ground robot's map by 3D structure alone, in simulation.",
    ]
    for job, verbs in JOBS.items():
        lines += ["", f"{job}:"]
        lines += [f"  {name:<{width}}  {line}" for name, (_, line) in verbs.items()]
    return "\n".join([*lines, "", "airground VERB --help lists the options of a verb."])


def parse(name: str, words: Sequence[str]) -> Verb:
    """The verb with its options; a word that does not fit ends the process with one line."""
    import tyro

    program = f"airground {name}"
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            return tyro.cli(
                verb_class(name),
                prog=program,
                args=list(words),
                config=(tyro.conf.FlagCreatePairsOff, tyro.conf.PositionalMetavarFromFieldName),
            )
    except SystemExit as exit_:
        if exit_.code not in (None, 0):
            said = _first_part(complaint.getvalue())
            clearer = _missing(name, said) or _unknown(name, said) or said
            console.print_error(f"{clearer} (see {program} --help)")
        raise


def _missing(name: str, said: str) -> str:
    """Tyro's message about missing options, without their help; empty for other messages."""
    from evaluation.commands.help import grouped_options

    if not said.startswith("Missing from"):
        return ""
    options = [one for group in grouped_options(verb_class(name)).values() for one in group]
    forms = [one.form for one in options if one.required and one.form.split()[0] in said.split()]
    return f"missing: {', '.join(forms)}" if forms else ""


def _unknown(name: str, said: str) -> str:
    """Tyro's message about options that a verb lacks, with the nearest that it has."""
    from evaluation.commands.help import grouped_options

    if not said.startswith("Unrecognized options:"):
        return ""
    known = [
        one.form.split()[0] for group in grouped_options(verb_class(name)).values() for one in group
    ]
    wrong = next((word.rstrip(",") for word in said.split() if word.startswith("--")), "")
    return f"{said};{_nearest(wrong, known)}".rstrip(";")


def _nearest(word: str, known: Iterable[str]) -> str:
    """A question for the known word that looks most like this one; empty if none does."""
    alike = difflib.get_close_matches(word, known, n=1)
    return f" did you mean {alike[0]}?" if alike else ""


def _first_part(box: str) -> str:
    """The text of tyro's framed message, between its title and its first rule.

    The frame is drawn with lines, or with hyphens where the screen's encoding lacks them.
    """
    words: list[str] = []
    for line in box.splitlines()[1:]:
        is_rule = not line.strip("│├┤╭╮╰╯─- ")
        if is_rule and words:
            break
        if not is_rule:
            words += line.strip("│ ").split()
    return " ".join(words).rstrip(".")
