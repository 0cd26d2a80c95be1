"""A command in a session of its own, with its own folder of temporary files."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

SHARED = Path("/dev/shm")
NAMES = ("psm_*", "sem.*")
"""Names that Python gives to shared memory and semaphores; other programs have others."""
MAIN = "from evaluation.cli import main; main()"
END_S = 20.0
"""Longest time until the processes of a killed command have ended [s]."""


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

    def kill(self, after_s: float, number: signal.Signals, child: int | None) -> tuple[int, Left]:
        """Send a signal to the command, or to one of its children, after a time.

        Args:
            after_s: Time from its start [s].
            number: The signal.
            child: Which child gets it, counted round; None for the command itself.

        Returns:
            Exit code, and what is left when all has ended.
        """
        before, scratch = shared_names(), self.temporary()
        process = self.start()
        try:
            process.wait(after_s)
        except subprocess.TimeoutExpired:
            target = process.pid
            below = [pid for pid in session(process.pid) if pid != process.pid]
            if child is not None and below:
                target = below[child % len(below)]
            if target in session(process.pid):
                os.kill(target, number)
        code = process.wait(600)
        end = time.monotonic() + END_S
        while session(process.pid) and time.monotonic() < end:
            time.sleep(0.05)
        processes = tuple(name_of(pid) for pid in session(process.pid))
        for pid in session(process.pid):
            os.kill(pid, signal.SIGKILL)
        shared = shared_names() - before
        temporary = self.temporary() - scratch
        beside = {path.name for path in self.folder.iterdir()} - {"tmp", "stderr", self.out}
        return code, Left(processes, tuple(shared), tuple(temporary), tuple(beside))

    def temporary(self) -> set[str]:
        """Names in its folder of temporary files, which stay for its next run."""
        folder = self.folder / "tmp"
        return {path.name for path in folder.iterdir()} if folder.exists() else set()

    def whole(self) -> bool:
        return self.output().exists()

    def output(self) -> Path:
        return self.folder / self.out

    def errors(self) -> Path:
        """What it printed to stderr."""
        return self.log or self.folder / "stderr"


def shared_names() -> set[str]:
    return {path.name for pattern in NAMES for path in SHARED.glob(pattern)}


def session(leader: int) -> list[int]:
    """Live processes of the session that a process leads."""
    found = []
    for path in Path("/proc").iterdir():
        if path.name.isdigit():
            try:
                state, _, _, number = (
                    path.joinpath("stat").read_text().rpartition(")")[2].split()[:4]
                )
            except (OSError, ValueError):
                continue
            if int(number) == leader and state != "Z":
                found.append(int(path.name))
    return sorted(found)


def name_of(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()[:100]
    except OSError:
        return "ended"


def digest(folder: Path, only: tuple[str, ...]) -> str:
    """Digest of the names and bytes of files with these endings; all without any."""
    made = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.is_file() and (not only or path.name.endswith(only)):
            made.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return made.hexdigest()
