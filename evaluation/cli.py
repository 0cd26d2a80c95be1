"""The command `airground`: picks the verb, reads its options, runs it.

A verb is a dataclass in `evaluation.commands`. Only the verb that was asked for is imported, and
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
    from evaluation.commands.options import Verb

JOBS: dict[str, dict[str, tuple[str, str]]] = {
    "data": {
        "simulate": ("data", "Record what the robots' sensors see in a scene, or in many."),
        "render": ("data", "Add exact truth of every pixel to a recording."),
        "inspect": ("data", "Say what is in a dataset, and what is wrong with it."),
        "export": ("data", "Write a recording, with its truth, in a format that other tools read."),
    },
    "one recording": {
        "run": ("run", "Run the pipeline over a recording and measure it against the truth."),
        "track": ("track", "Track one robot alone, with one front end or several."),
        "live": (
            "live",
            "Play a recording at its own rate through the pipeline, as live robots would send it.",
        ),
        "view": ("look", "Look into a run with rerun: in a window, a browser, or as a file."),
        "gallery": (
            "look",
            "Draw the pictures of a run as PNG files: maps, depth, costs, particles, errors.",
        ),
    },
    "many recordings": {
        "reproduce": ("reproduce", "Do all of it: the paper's protocol, from scenes to report."),
        "sweep": ("sweep", "Turn dials, and measure what that does: curves with intervals."),
    },
    "results": {
        "evaluate": ("results", "Put the results of one or more runs into one report."),
        "compare": ("results", "Draw two to four runs on one page: what changed, and by how much."),
        "check": (
            "results",
            "Hold results against accepted ones: better, worse, or no difference seen.",
        ),
        "accept": ("results", "Accept results: later changes are held against them."),
    },
    "this machine": {
        "bench": ("machine", "Time the pipeline's stages on this machine (Table I)."),
        "doctor": (
            "machine",
            "Look whether this machine can render and compute, and say what is missing.",
        ),
    },
}
"""Verbs by job, each with its module in `evaluation.commands` and the first line of its help."""
VERBS = {name: verb for verbs in JOBS.values() for name, verb in verbs.items()}


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
    if "-h" in rest or "--help" in rest:
        from evaluation.commands.help import help_text

        print(help_text(name, verb_class(name)))
        return console.EXIT_OK
    return carry_out(parse(name, rest))


def carry_out(verb: Verb) -> int | None:
    """Settle threads, rendering and logging, then do what the verb does."""
    prepare(verb.threads)
    console.start_logging(verb.verbose)
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


def verb_class(name: str) -> type[Verb]:
    """The dataclass of a verb."""
    module = importlib.import_module(f"evaluation.commands.{VERBS[name][0]}")
    verb: type[Verb] = getattr(module, name.capitalize())
    return verb


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
            console.print_error(f"{_missing(name, said) or said} (see {program} --help)")
        raise


def _missing(name: str, said: str) -> str:
    """Tyro's message about missing options, without their help; empty for other messages."""
    from evaluation.commands.help import grouped_options

    if not said.startswith("Missing from"):
        return ""
    options = [one for group in grouped_options(verb_class(name)).values() for one in group]
    forms = [one.form for one in options if one.required and one.form.split()[0] in said.split()]
    return f"missing: {', '.join(forms)}" if forms else ""


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
