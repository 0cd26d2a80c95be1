"""How far the work is, and how long it may still take."""

from __future__ import annotations

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

DAY_S = 24 * 3600.0


def progress_bar(what: str, total: int, done: int = 0) -> Progress:
    """Shows what is done and the time left; nothing where nobody looks."""
    console = Console(stderr=True)
    progress = Progress(
        TextColumn(what),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
        speed_estimate_period=DAY_S,  # units take minutes
    )
    progress.add_task("", total=total, completed=done)
    return progress
