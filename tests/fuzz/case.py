"""One damaged input, drawn from a seed and a number, and what became of it."""

from __future__ import annotations

import gc
import os
import shutil
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from evaluation.setup import console
from tests.fuzz.bombs import BOMBS
from tests.fuzz.damage import BYTES, TEXT, replace_place
from tests.fuzz.harmless import KEPT, LINK, changes_of, put_behind_link
from tests.fuzz.meaning import meaning
from tests.fuzz.structure import BY_SUFFIX
from tests.fuzz.subjects import SUBJECTS, fresh

BINARY = {".png", ".npz", ".parquet", ".bag", ".mcap", ".db3"}
"""Files of which no lines or numbers can be damaged."""
REFUSAL_S = 5.0
"""Most processor time until an input is refused [s]."""
WORK_S = 20.0
"""Most processor time for work on an input that is accepted [s]."""
WAIT_S = 120.0
"""Longest time in all, on a busy machine too [s]: who waits for a pipe uses no processor."""
WORKED_ON = 10
"""One input in so many is worked on; the others are read."""
MEMORY_MIB = 1024
"""Most memory by which a process may grow over one input [MiB]."""
LONGEST_LINE = 1000
"""Characters of the longest message that a reader can take in."""
PLACE = "another thing in its place"
BOMB = "bomb"
UNCHANGED = "nothing changed"
"""Damages after which an input, where it is accepted, must mean what it meant before."""


Announce = Callable[[str, str, str], object]
"""Consumer of an input, a damage and a file, before the input is used."""


@dataclass(frozen=True)
class Outcome:
    """What became of one input.

    Attributes:
        subject, damage, file: Kind of input, what was done to it, and to which file.
        verdict: "works", "refused", or what is wrong.
        words: The message, or the end of a traceback.
    """

    number: int
    subject: str
    damage: str
    file: str
    verdict: str
    words: str
    seconds: float

    @property
    def is_finding(self) -> bool:
        return self.verdict not in ("works", "refused")


class Bench:
    """Good inputs in a folder of their own, damaged and mended one at a time."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._contents: dict[str, dict[Path, bytes]] = {}
        self._meanings: dict[str, str] = {}

    def run(self, seed: int, number: int, announce: Announce) -> Outcome:
        """Draw a case, damage the input, say so, use it, and mend it."""
        rng = np.random.default_rng([seed, number])
        weights = np.array([subject.weight for subject in SUBJECTS.values()], float)
        name = str(rng.choice(list(SUBJECTS), p=weights / weights.sum()))
        contents = self._good(name)
        suffixes = sorted({path.suffix for path in contents})
        suffix = suffixes[int(rng.integers(len(suffixes)))]
        files = sorted(path for path in contents if path.suffix == suffix)
        path = files[int(rng.integers(len(files)))]
        damage = self._damage(name, path, contents[path], rng)
        unchanged = damage.startswith(UNCHANGED)
        relative = str(path.relative_to(self._folder / "in" / name))
        announce(name, damage, relative)
        try:
            work = number % WORKED_ON == 0 and not unchanged
            verdict, words, seconds, read = self._use(name, work)
        finally:
            self._mend(name, path)
        if unchanged and verdict == "works" and meaning(read) != self._meanings[name]:
            verdict = "means something else"
        damage = UNCHANGED if unchanged else damage
        return Outcome(number, name, damage, relative, verdict, words, seconds)

    def check_good(self) -> None:
        """Every kind of input works before it is damaged."""
        for name in SUBJECTS:
            self._good(name)
            for work in (True, False):
                verdict, words, _, read = self._use(name, work)
                assert verdict == "works", f"{name}: {verdict}: {words}"
            self._meanings[name] = meaning(read)

    def _use(self, name: str, work: bool) -> tuple[str, str, float, object]:
        """As `judge`, and what was read."""
        subject, folder = SUBJECTS[name], self._folder / "in" / name
        use = subject.work if work else subject.read
        read: list[object] = []

        def command() -> None:
            read.append(use(folder, fresh(self._folder / "out")))

        judged = judge(command, self._folder / "screen")
        return *judged, read[0] if read else None

    def _good(self, name: str) -> dict[Path, bytes]:
        if name not in self._contents:
            folder = fresh(self._folder / "in" / name)
            SUBJECTS[name].make(folder)
            files = sorted(path for path in folder.rglob("*") if path.is_file())
            self._contents[name] = {path: path.read_bytes() for path in files}
        return self._contents[name]

    def _damage(self, name: str, path: Path, data: bytes, rng: np.random.Generator) -> str:
        """Damage a file; returns what was done."""
        kinds = dict(BYTES) if path.suffix in BINARY else dict(BYTES) | dict(TEXT) | dict(TEXT)
        names = [*kinds, PLACE]
        if path.suffix in BY_SUFFIX:
            label, structural = BY_SUFFIX[path.suffix]
            kinds[label] = structural
            names += [label] * (len(names) // 2)
        if path.suffix in BOMBS:
            kinds[BOMB] = BOMBS[path.suffix]
            names += [BOMB] * 2
        changes = changes_of(path, data)
        names += [UNCHANGED] * (2 if changes else 1)
        kind = names[int(rng.integers(len(names)))]
        if kind == UNCHANGED:
            return f"{UNCHANGED}: {self._change(name, path, data, rng)}"
        if kind == PLACE:
            replace_place(path, rng)
        else:
            path.write_bytes(kinds[kind](data, rng))
        return kind

    def _change(self, name: str, path: Path, data: bytes, rng: np.random.Generator) -> str:
        """Do what changes nothing, and bring the digests of a recording up to date."""
        changes, folder = changes_of(path, data), self._folder / "in" / name
        kind = [LINK, *changes][int(rng.integers(1 + len(changes)))]
        if kind == LINK:
            put_behind_link(path, folder)
        else:
            path.write_bytes(changes[kind](data, rng))
            SUBJECTS[name].settle(folder, path)
        return kind

    def _mend(self, name: str, path: Path) -> None:
        for there in (path, path.with_name(f"{path.name}.elsewhere")):
            if there.is_dir() and not there.is_symlink():
                shutil.rmtree(there)
            else:
                there.unlink(missing_ok=True)
        for kept in (self._folder / "in" / name).rglob(KEPT):
            kept.unlink()
        for file, data in self._contents[name].items():
            if file == path or (file.suffix == ".toml" and file.read_bytes() != data):
                file.write_bytes(data)


def judge(use: Callable[[], object], screen_file: Path) -> tuple[str, str, float]:
    """Verdict, words and processor seconds of one use of an input, as the command ends."""
    gc.collect()
    reset_peak()
    before_mib, started = resident_mib(), time.process_time()

    def command() -> None:
        use()

    with screen(screen_file), warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", ResourceWarning)  # as in a command
        signal.setitimer(signal.ITIMER_PROF, WORK_S)
        signal.setitimer(signal.ITIMER_REAL, WAIT_S)
        try:
            code, place = console.run(command, verbose=True), ""
        except TooLong as error:
            code, place = -1, str(error)
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.setitimer(signal.ITIMER_REAL, 0)
    seconds = time.process_time() - started
    words = screen_file.read_text("utf-8", "replace")
    if code == -1:
        return "hangs", place, seconds
    grown_mib = resident_mib(peak=True) - before_mib
    return verdict_on(code, words, seconds, grown_mib), words[-1500:], seconds


def verdict_on(code: int, words: str, seconds: float, grown_mib: float) -> str:
    """What an exit code, the screen, time and memory mean together."""
    lines = [line for line in words.splitlines() if line.strip()]
    if code == console.EXIT_INTERNAL:
        return "traceback"
    if "out of memory" in words or grown_mib > MEMORY_MIB:
        return f"grows by {grown_mib:.0f} MiB"
    if code not in (console.EXIT_OK, console.EXIT_ERROR):
        return f"exit code {code}"
    if code == console.EXIT_OK:
        return "warns" if "Warning" in words else "works"
    if seconds > REFUSAL_S:
        return "refuses late"
    if len(lines) != 1:
        return "more than one line"
    if len(lines[0]) > LONGEST_LINE or not lines[0].isprintable():
        return "unreadable line"
    return "refused"


class TooLong(BaseException):
    """Work took longer than WORK_S; no handler of Exception takes it."""


def too_long(_signal: int, frame: object) -> None:
    place = f"{frame.f_code.co_filename}:{frame.f_lineno}"  # type: ignore[attr-defined]
    raise TooLong(place)


@contextmanager
def screen(path: Path) -> Iterator[None]:
    """Sends what Python and libraries write to stdout and stderr to a file."""
    sys.stdout.flush()
    sys.stderr.flush()
    saved = os.dup(1), os.dup(2)
    file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o600)
    os.dup2(file, 2)
    os.dup2(file, 1)
    try:
        yield
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        for number, kept in zip((1, 2), saved, strict=True):
            os.dup2(kept, number)
            os.close(kept)
        os.close(file)


def reset_peak() -> None:
    Path("/proc/self/clear_refs").write_text("5")


def resident_mib(peak: bool = False) -> float:
    key = "VmHWM:" if peak else "VmRSS:"
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(key):
            return int(line.split()[1]) / 1024
    raise RuntimeError("no memory in /proc/self/status")
