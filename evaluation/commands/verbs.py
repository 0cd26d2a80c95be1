"""The verbs of the command `airground`: a literal table. A verb is a dataclass of its module."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from evaluation.commands.options import Verb

JOBS: dict[str, dict[str, tuple[str, str]]] = {
    "data": {
        "simulate": ("data", "Record what the robots' sensors see in a scene, or in many."),
        "render": ("data", "Add truth of pixels, lidar scans or stereo pairs to a recording."),
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
    "benchmark": {
        "submit": ("score", "Collect the claims of runs as a submission to score."),
        "score": (
            "score",
            "Score submissions against the truth that simulate --sealed has put aside.",
        ),
    },
    "results": {
        "evaluate": ("results", "Put the results of one or more runs into one report."),
        "compare": ("results", "Draw two to four runs on one page: what changed, and by how much."),
        "check": (
            "results",
            "Hold results against accepted ones: better, worse, or no difference seen.",
        ),
        "accept": ("results", "Accept results: later changes are held against them."),
        "history": (
            "history",
            "Draw accuracy over revisions: figures, intervals and steps, as a page and as JSON.",
        ),
    },
    "this machine": {
        "bench": ("machine", "Time the pipeline's stages on this machine (Table I)."),
        "doctor": (
            "machine",
            "Look whether this machine can render and compute, and say what is missing.",
        ),
        "completion": (
            "completion",
            "Print a script that completes verbs, options and their values in a shell.",
        ),
    },
}
"""Verbs by job, each with its module in `evaluation.commands` and the first line of its help."""
VERBS = {name: verb for verbs in JOBS.values() for name, verb in verbs.items()}


def verb_class(name: str) -> type[Verb]:
    """The dataclass of a verb."""
    module = importlib.import_module(f"evaluation.commands.{VERBS[name][0]}")
    verb: type[Verb] = getattr(module, name.capitalize())
    return verb
