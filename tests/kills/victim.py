"""A command in a session of its own, with its own folder of temporary files."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tests.kills.roles import Role, name_of, send, session

SHARED = Path("/dev/shm")
NAMES = ("psm_*", "sem.*")
"""Names that Python gives to shared memory and semaphores; other programs have others."""
MAIN = "from evaluation.cli import main; main()"
END_S = 20.0
"""Longest time until the processes of a killed command have ended [s]."""
LONGEST_S = 900.0
"""Longest time of a command, on a busy machine [s]; one that goes on for longer is stuck."""
KEPT = "airground-*-*.lock"
"""Lock files of compiling, which stay among temporary files."""


@dataclass(frozen=True)
class Left:
    """What one kill left: processes, shared memory and temporary files that were not there
    before, and files beside the output."""

    processes: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()
    temporary: tuple[str, ...] = ()
    half_written: tuple[str, ...] = ()


@dataclass(frozen=True)
class Command:
    """The words of a command, which writes `out`; `folder` holds it and its temporary files.

    What it prints goes to `log`, by default in the same folder.
    """

    words: tuple[str, ...]
    folder: Path
    out: str = "out"
    log: Path | None = None

    def start(self) -> subprocess.Popen[bytes]:
        temporary = self.folder / "tmp"
        temporary.mkdir(exist_ok=True)
        return subprocess.Popen(
            [sys.executable, "-c", MAIN, *self.words, "--out", str(self.output())],
            env=os.environ | {"TMPDIR": str(temporary)},
            stdout=subprocess.DEVNULL,
            stderr=self.errors().open("wb"),
            start_new_session=True,
        )

    def finish(self) -> float:
        """Seconds of a run to the end, which must succeed."""
        started = time.monotonic()
        code = self.start().wait()
        assert code == 0, f"exit code {code}: {self.errors().read_text()[-500:]}"
        return time.monotonic() - started

    def kill(
        self, after_s: float, number: signal.Signals, wanted: Role, choice: int
    ) -> tuple[int, Role | None, Left]:
        """Send a signal to a process of the command, after a time.

        Args:
            after_s: Time from its start [s].
            number: The signal.
            wanted: Role of the process that gets it, if there is one at that time.
            choice: Which of several processes of that role, counted round.

        Returns:
            Exit code, the role that got the signal (None: it had ended), and what is left when all
            processes have ended.
        """
        before, scratch, unfinished = shared_names(), self.temporary(), self.beside()
        process = self.start()
        hit = None
        try:
            process.wait(after_s)
        except subprocess.TimeoutExpired:
            hit = send(number, wanted, process.pid, choice)
        with suppress(subprocess.TimeoutExpired):  # its processes are then among what is left
            process.wait(LONGEST_S)
        end = time.monotonic() + END_S
        while session(process.pid) and time.monotonic() < end:
            time.sleep(0.05)
        processes = tuple(name_of(pid) for pid in session(process.pid))
        for pid in session(process.pid):
            os.kill(pid, signal.SIGKILL)
        code = process.wait()
        new = (shared_names() - before, self.temporary() - scratch, self.beside() - unfinished)
        return code, hit, Left(processes, *map(tuple, new))

    def beside(self) -> set[str]:
        """Names beside its output."""
        return {path.name for path in self.folder.iterdir()} - {"tmp", "stderr", self.out}

    def temporary(self) -> set[str]:
        """Names in its folder of temporary files, which stay for its next run."""
        folder = self.folder / "tmp"
        every = folder.iterdir() if folder.exists() else ()
        return {path.name for path in every if not path.match(KEPT)}

    def whole(self) -> bool:
        return self.output().exists()

    def output(self) -> Path:
        return self.folder / self.out

    def errors(self) -> Path:
        """What it printed to stderr."""
        return self.log or self.folder / "stderr"


def shared_names() -> set[str]:
    return {path.name for pattern in NAMES for path in SHARED.glob(pattern)}
