"""A command over a recording, with the memory of all its processes as it goes."""

from __future__ import annotations

import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import psutil

from evaluation.setup.memory import resident_mib
from evaluation.table.rows import LIVE_STAGE, ResultTable
from tests.sources import ROOT

CLI = "from evaluation.cli import main; main()"
PROGRESS = re.compile(r"running: (\d+)/(\d+) images")
"""A line of the command's progress; one comes every ten seconds."""
ROBOTS = ("mav", "ground")
STEAL_PERIOD_S = 0.1


@dataclass(frozen=True)
class Watched:
    """Outcome of a command.

    Attributes:
        code: Exit code.
        memory: Recorded time that had passed [s], and memory then, shared pages once [MiB].
        at_end_mib: The most after the last image, when the results are put together [MiB].
        said: The end of what it printed.
        stolen: Recorded time that had passed [s], and how long the hypervisor had kept cores from
            this machine by then, all cores together [ms].
    """

    code: int
    memory: list[tuple[float, float]]
    at_end_mib: float | None
    said: str
    stolen: list[tuple[float, float]] = field(default_factory=list)

    def held_mib(self, at_s: float) -> float | None:
        """Memory once so much was tracked; None if it was not read after that."""
        return next((mib for time_s, mib in self.memory if time_s >= at_s), None)

    def growth_mib(self, since_s: float) -> float | None:
        """The most memory after a time, beyond that at the time; None before it has come."""
        later = [mib for time_s, mib in self.memory if time_s >= since_s]
        return max(later) - later[0] if len(later) > 1 else None

    def stolen_ms(self, at_s: float, around_s: float = 0.5) -> float:
        """Time that the hypervisor kept cores from this machine around a recorded time [ms]."""
        near = [ms for time_s, ms in self.stolen if abs(time_s - at_s) <= around_s]
        return near[-1] - near[0] if near else 0.0


def watch(words: list[str], duration_s: float) -> Watched:
    """Run `airground WORDS` over a recording of this length, to its end."""
    command = [sys.executable, "-c", CLI, *words]
    memory: list[tuple[float, float]] = []
    at_end_mib: float | None = None
    said: list[str] = []
    started_s = np.inf
    with (
        steal_clock() as stolen,
        subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT
        ) as process,
    ):
        assert process.stdout is not None
        for line in process.stdout:
            said.append(line)
            match = PROGRESS.match(line)
            if match is None:
                continue
            mib = resident_mib(_processes(process.pid))
            done, total = int(match[1]), int(match[2])
            started_s = min(started_s, time.monotonic() - duration_s * done / total)
            if mib is None:
                continue
            if done == total:
                at_end_mib = max(mib, at_end_mib or 0.0)
            else:
                memory.append((duration_s * done / total, mib))
    passed = [(wall_s - started_s, ms) for wall_s, ms in stolen]
    return Watched(process.returncode, memory, at_end_mib, "".join(said[-5:]), passed)


@contextmanager
def steal_clock() -> Iterator[list[tuple[float, float]]]:
    """Monotonic time [s] and stolen time of all cores [ms], read while the context lasts."""
    readings: list[tuple[float, float]] = []
    ended = threading.Event()

    def read() -> None:
        while not ended.wait(STEAL_PERIOD_S):
            readings.append((time.monotonic(), 1e3 * getattr(psutil.cpu_times(), "steal", 0.0)))

    reader = threading.Thread(target=read)
    reader.start()
    try:
        yield readings
    finally:
        ended.set()
        reader.join()


def _processes(first: int) -> list[int]:
    """A process and all that it has started."""
    try:
        return [first, *(child.pid for child in psutil.Process(first).children(recursive=True))]
    except psutil.Error:
        return [first]


@dataclass(frozen=True)
class Poses:
    """How one robot's poses came, of a live run, and how right they were.

    Attributes:
        late_ms: (N,) time from each image to its pose [ms]; none where the run was not live.
        at_s: (N,) when each of these images was taken, since the first [s].
        dropped: Number of images that were dropped.
        final_m: RMS error of the final positions [m].
    """

    late_ms: np.ndarray
    at_s: np.ndarray
    dropped: int
    final_m: float

    @classmethod
    def of(cls, table: ResultTable, robot: str) -> Poses:
        """By the results of a run."""
        dropped = table.values(LIVE_STAGE, f"{robot}_dropped")
        final = table.values("trajectory", f"{robot}_final_ate_se3_rmse_m")
        posed = table.rows(LIVE_STAGE, f"{robot}_posed_ms")
        late_ms, at_s = (posed[name].to_numpy(np.float64) for name in ("value", "time_s"))
        return cls(late_ms, at_s, int(dropped.sum()), float(final[0]))

    def later_than(self, limit_ms: float) -> list[tuple[float, float]]:
        """Time of each image whose pose came later [s], and how late that was [ms]."""
        late = self.late_ms > limit_ms
        return list(zip(self.at_s[late].tolist(), self.late_ms[late].tolist(), strict=True))


def poses(out: Path) -> dict[str, Poses]:
    """Both robots' poses by the results in a folder."""
    table = ResultTable.read(out / "results.parquet")
    return {robot: Poses.of(table, robot) for robot in ROBOTS}
