"""Many cases in processes of their own: one that crashes or stands still is a finding, too."""

from __future__ import annotations

import gc
import multiprocessing
import signal
import tempfile
from collections import Counter
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from tests.fuzz.case import WAIT_S, Bench, Outcome, too_long

SPAWN = multiprocessing.get_context("spawn")
START_S = 300.0
"""Longest time until a process has imported everything, on a busy machine [s]."""


def outcomes(seed: int, numbers: range) -> Iterator[Outcome]:
    """What becomes of each case, by one process after another."""
    left = list(numbers)
    with tempfile.TemporaryDirectory(prefix="airground-fuzz-") as folder:
        while left:
            mine, theirs = SPAWN.Pipe()
            process = SPAWN.Process(target=_work, args=(folder, seed, left, theirs))
            process.start()
            theirs.close()
            try:
                assert mine.poll(START_S), "the process does not start"
                mine.recv()
                while left:
                    what = _receive(mine) or ("?", "?", "?")
                    found = _receive(mine)
                    if found is None:
                        process.kill()
                        process.join()
                        words = f"exit code {process.exitcode}"
                        found = Outcome(left[0], *what, "dies or stands still", words, 0.0)
                    left.pop(0)
                    yield found
                    if not process.is_alive() and left:
                        break
            finally:
                process.kill()
                process.join()


def _receive(pipe: Connection) -> Any:
    """What the process says next; None if it says nothing more."""
    try:
        return pipe.recv() if pipe.poll(2 * WAIT_S) else None
    except EOFError:
        return None


def _work(folder: str, seed: int, numbers: list[int], pipe: Connection) -> None:
    signal.signal(signal.SIGALRM, too_long)
    signal.signal(signal.SIGPROF, too_long)
    scratch = tempfile.mkdtemp(dir=folder)
    tempfile.tempdir = scratch
    bench = Bench(Path(scratch))
    bench.check_good()
    gc.freeze()  # or each collection between cases looks at all that was imported
    pipe.send("ready")
    for number in numbers:
        pipe.send(bench.run(seed, number, lambda *what: pipe.send(what)))


def table(found: list[Outcome]) -> str:
    """Counts by kind of input and by damage, as Markdown."""
    lines = []
    for title, key in (("input", "subject"), ("damage", "damage")):
        counts: dict[str, Counter[str]] = {}
        for one in found:
            verdict = "finding" if one.is_finding else one.verdict
            counts.setdefault(getattr(one, key), Counter())[verdict] += 1
        lines += [f"| {title} | tried | works | refused | findings |", "|---|---|---|---|---|"]
        for name, by in sorted(counts.items()):
            cells = by["works"], by["refused"], by["finding"]
            lines.append(f"| {name} | {by.total()} | {' | '.join(map(str, cells))} |")
        lines.append("")
    return "\n".join(lines)
