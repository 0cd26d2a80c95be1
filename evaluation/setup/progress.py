"""Progress of long work, on stderr: bars on a terminal, else a plain line every ten seconds.

Code that works for long opens a `step` and advances it. Steps are shown only inside `shown`,
which the command opens: libraries, tests and worker processes stay silent.
"""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rich.console import Console

Item = TypeVar("Item")

PLAIN_INTERVAL_S = 10.0
"""Time between two plain lines [s]; 15 s are promised, and compiling may delay a line."""
BARS_PER_SECOND = 2
"""Refresh rate of bars [Hz]: often enough to look alive, without load on what is measured."""


class Step:
    """A piece of work whose extent is known.

    Args:
        what: Name of the work, as in "measuring".
        total: Extent of the work in `unit`; None if unknown.
        unit: Unit of `total`, in the plural: "units", "s recorded".
        done: Extent that is done already.
    """

    def __init__(
        self, what: str, total: float | None = None, unit: str = "", done: float = 0.0
    ) -> None:
        self.what, self.total, self.unit, self.done = what, total, unit, done
        self.note = ""
        self._before, self._in_part = done, 0
        self._started = time.monotonic()

    def advance(self, amount: float = 1.0) -> None:
        self.done += amount

    def move_to(self, done: float, total: float | None = None) -> None:
        """Set what is done, and the total where it has become known."""
        self.done = done
        self.total = self.total if total is None else total

    def along(self, items: Iterable[Item]) -> Iterator[Item]:
        """Pass items through, and count each once it has been dealt with."""
        for item in items:
            yield item
            self.advance()

    def say(self, note: str) -> None:
        self.note = note

    def next(self, note: str) -> None:
        """Name the part that begins now; the one before it, if it was named so, is done."""
        self.done += self._in_part
        self._in_part, self.note = 1, note

    @property
    def elapsed_s(self) -> float:
        return time.monotonic() - self._started

    @property
    def left_s(self) -> float | None:
        """Estimate of the time left [s], the command's until there is a rate; None if unknown.
        Work of unknown extent that follows other work has no estimate: what was expected of the
        command has been too long or too short by then.
        """
        gained = self.done - self._before
        if self.total is not None and gained > 0:
            return max(0.0, self.elapsed_s / gained * (self.total - self.done))
        if self.total is None and _some_done:
            return None
        left_s = 0.0 if _due is None else _due - time.monotonic()
        return left_s if left_s > 0 else None

    def extent(self) -> str:
        """What is done of how much: "3/8 units"."""
        if self.total is None:
            return ""
        return f"{self.done:.0f}/{self.total:.0f} {self.unit}".rstrip()

    def line(self) -> str:
        """One plain line: what, how much of it, time elapsed, time left."""
        left = self.left_s
        parts = [self.note, self.extent(), f"elapsed {clock(self.elapsed_s)}"]
        if left is not None:
            parts.append(f"left about {clock(left)}")
        return f"{self.what}: {', '.join(part for part in parts if part)}"


_open_steps: list[Step] = []
_display: _Plain | _Bars | None = None
_due: float | None = None  # when the command ought to be done, by time.monotonic
_some_done = False  # whether work of known extent has ended


@contextmanager
def step(
    what: str, total: float | None = None, unit: str = "", done: float = 0.0
) -> Iterator[Step]:
    """A step that is shown, inside `shown`, until the block ends; arguments as of `Step`."""
    global _some_done
    opened = Step(what, total, unit, done)
    _open_steps.append(opened)
    if _display is not None:
        _display.begin(opened)
    try:
        yield opened
    finally:
        _open_steps.remove(opened)
        _some_done |= _display is not None and total is not None
        if _display is not None:
            _display.end(opened)


def announce(what: str, expected_s: float | None = None) -> None:
    """Say in one line what a command does and how long that takes [s], None if unknown."""
    global _due
    if _display is not None:
        _due = None if expected_s is None else time.monotonic() + expected_s
        _display.write(what if expected_s is None else f"{what}; takes {roughly(expected_s)}")


@contextmanager
def shown() -> Iterator[None]:
    """Show every step that is open during the block."""
    global _display, _due, _some_done
    _display = _Bars(stderr()) if stderr().is_terminal else _Plain()
    try:
        yield
    finally:
        _display.close()
        _display = _due = None
        _some_done = False


@cache
def stderr() -> Console:
    """The console of bars and log, one for both, so that a message does not break a bar."""
    from rich.console import Console

    return Console(stderr=True)


class _Plain:
    """Writes a line of the innermost open step at fixed intervals."""

    def __init__(self) -> None:
        self._reported: set[Step] = set()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._repeat, name="progress", daemon=True)
        self._thread.start()

    def write(self, line: str) -> None:
        with contextlib.suppress(OSError, ValueError):  # a reader that has gone ends no work
            print(line, file=sys.stderr, flush=True)

    def begin(self, step: Step) -> None:
        pass

    def end(self, step: Step) -> None:
        if step in self._reported:
            self._reported.remove(step)
            self.write(step.line())

    def close(self) -> None:
        self._over.set()
        self._thread.join()

    def _repeat(self) -> None:
        while not self._over.wait(PLAIN_INTERVAL_S):
            for step in _open_steps[-1:]:
                self._reported.add(step)
                self.write(step.line())


class _Bars:
    """Draws a bar for each open step."""

    def __init__(self, console: Console) -> None:
        from rich.progress import BarColumn, Progress, ProgressColumn, Task, TaskID
        from rich.text import Text

        class StepColumn(ProgressColumn):
            """The text of the plain line."""

            def render(self, task: Task) -> Text:
                step: Step = task.fields["step"]
                task.completed, task.total = step.done, step.total  # for the bar beside it
                return Text(step.line(), no_wrap=True, overflow="ellipsis")

        self._console = console
        self._tasks: dict[Step, TaskID] = {}
        self._bars = Progress(
            StepColumn(),
            BarColumn(20),
            console=console,
            transient=True,
            redirect_stdout=False,  # results go to stdout as they are
            redirect_stderr=False,
            refresh_per_second=BARS_PER_SECOND,
        )

    def write(self, line: str) -> None:
        self._console.print(line, markup=False, highlight=False)

    def begin(self, step: Step) -> None:
        self._tasks[step] = self._bars.add_task("", total=step.total, step=step)
        self._bars.start()

    def end(self, step: Step) -> None:
        self._bars.remove_task(self._tasks.pop(step))
        if not self._tasks:
            self._bars.stop()

    def close(self) -> None:
        self._bars.stop()


def clock(seconds: float) -> str:
    """A duration as 0:07, 12:30 or 3:05:00."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def roughly(seconds: float) -> str:
    """A duration in words, to no more digits than an estimate has."""
    if seconds < 15:
        return "some seconds"
    if seconds < 100:
        return f"about {round(seconds, -1):.0f} s"
    if seconds < 100 * 60:
        return f"about {seconds / 60:.0f} min"
    return f"about {seconds / 3600:.0f} h"
