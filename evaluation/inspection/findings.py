"""Findings: what was looked at, what was found, and whether that is as it should be."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum

from rich.console import Console
from rich.table import Table


class Verdict(StrEnum):
    """What a finding means."""

    FINE = "ok"
    NOTED = "note"
    WRONG = "wrong"


@dataclass(frozen=True)
class Finding:
    """One line of the table.

    Attributes:
        part: Of the dataset: "mav", "ground", or "" for all of it.
        subject: What was looked at.
        found: In words and numbers.
        verdict: What that means.
    """

    part: str
    subject: str
    found: str
    verdict: Verdict = Verdict.FINE


def show(title: str, findings: Sequence[Finding], console: Console | None = None) -> None:
    """Print findings as a table."""
    colours = {Verdict.FINE: "green", Verdict.NOTED: "yellow", Verdict.WRONG: "bold red"}
    shown = Table(title=title, title_justify="left")
    for header in ("", "what", "found", ""):
        shown.add_column(header)
    for one in findings:
        colour = colours[one.verdict]
        shown.add_row(one.part, one.subject, one.found, f"[{colour}]{one.verdict}[/]")
    (console or Console()).print(shown)


def as_json(dataset: str, layout: str, findings: Sequence[Finding]) -> str:
    """The same for programs."""
    content = {
        "schema": "airground-inspection",
        "version": 1,
        "dataset": dataset,
        "layout": layout,
        "wrong": sum(one.verdict is Verdict.WRONG for one in findings),
        "findings": [asdict(one) for one in findings],
    }
    return json.dumps(content, indent=2)
