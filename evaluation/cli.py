"""The command `airground`: picks the verb, reads its words, runs it.

A verb is a dataclass in `evaluation.commands`: its docstring is the help, its fields are
the options, `main()` is what it does. Only the verb that was asked for is imported, and
heavy imports wait for its `main()`, so that `--help` answers at once.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from airground import __version__
from evaluation.setup import console, progress
from evaluation.setup.environment import prepare

if TYPE_CHECKING:
    from evaluation.commands.words import Verb

VERBS = {
    "simulate": "Record what the robots' sensors see in a scene, or in many.",
    "run": "Run the pipeline over a recording and measure it against the truth.",
    "evaluate": "Put the results of one or more runs into one report.",
    "compare": "Draw two to four runs on one page: what changed, and by how much.",
    "reproduce": "Do all of it: the paper's protocol, from scenes to report.",
    "sweep": "Turn dials, and measure what that does: curves with intervals.",
    "check": "Hold results against accepted ones: better, worse, or no difference seen.",
    "accept": "Accept results: later changes are held against them.",
    "view": "Look into a run with rerun: in a window, in a browser, or as a file to send.",
    "gallery": "Draw the pictures of a run as PNG files: maps, depth, costs, particles, errors.",
    "inspect": "Say what is in a dataset, and what is wrong with it.",
    "export": "Write a recording, with its truth, in a format that other tools read.",
    "bench": "Time the pipeline's stages on this machine (Table I).",
    "doctor": "Look whether this machine can render and compute, and say what is missing.",
}
"""Each verb `x` is the class `X` in `evaluation.commands.x`."""


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
        console.print_error(f"unknown verb {name!r}; known: {', '.join(VERBS)}")
        return console.EXIT_ERROR
    return carry_out(parse(name, rest))


def carry_out(verb: Verb) -> int | None:
    """Settle threads, rendering and logging, then do what the verb does."""
    prepare(verb.threads)
    console.start_logging(verb.verbose)
    with progress.shown():
        return verb.main()


def overview() -> str:
    """What `airground --help` says."""
    width = max(map(len, VERBS))
    verbs = "\n".join(f"  {name:<{width}}  {line}" for name, line in VERBS.items())
    return (
        "usage: airground VERB [WORDS]\n\n"
        "Locate a drone in a ground robot's map by 3D structure alone, in simulation.\n\n"
        f"verbs:\n{verbs}\n\n"
        "airground VERB --help says what words a verb takes."
    )


def verb_class(name: str) -> type[Verb]:
    """The dataclass of a verb."""
    return getattr(importlib.import_module(f"evaluation.commands.{name}"), name.capitalize())


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
                config=(tyro.conf.FlagCreatePairsOff,),
            )
    except SystemExit as exit_:
        if exit_.code not in (None, 0):
            console.print_error(f"{_first_part(complaint.getvalue())} (see {program} --help)")
        raise


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
