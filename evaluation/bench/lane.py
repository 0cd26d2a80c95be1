"""A lane: one process with a fixed number of cores, which holds the material and takes turns.
Some libraries read the number of threads once, when they are loaded, so one process cannot serve
two numbers. A lane of one core is bound to one: no thread of any library can help."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Concatenate, ParamSpec, TypeVar

import numpy as np

from airground.config import Config
from airground.errors import AirgroundError, InputError
from airground.io.recording import Recording
from airground.warm_up import warm_up_mapping
from evaluation.bench.curves import CURVES_BY_NAME, CurvePoint
from evaluation.bench.floors import Floor, Speed
from evaluation.bench.machine import probe
from evaluation.bench.material import Material, Played, play
from evaluation.bench.rows import BY_NAME, Contender
from evaluation.bench.work import Turn, Work, take_turn
from evaluation.judge.live_summary import LiveSummary, live_summary
from evaluation.run.live.live_run import run_live
from evaluation.run.live.playback import Playback
from evaluation.setup.environment import prepare_worker, settle
from evaluation.setup.memory import AddedMemory
from evaluation.setup.setups import Setup
from sim.interrupts import deaf_children, end_children
from sim.recording.truth import Truth

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True)
class Opened:
    """What a lane measured while it made its material.
    `played` is None unless the recording was played to its end."""

    speed: Speed
    played: Played | None


@dataclass(frozen=True)
class Facts:
    """What is known of a row before it is timed; `peers` are installed, `missing` are not."""

    size: str
    floor: Floor | None
    peers: tuple[str, ...]
    missing: tuple[str, ...]


class Lane:
    """The material, and the work that was made of it for the row at hand."""

    def __init__(self, material: Material) -> None:
        self._material = material
        self._made: dict[Contender | CurvePoint, Work] = {}

    def facts(self, row: str) -> Facts:
        """Make a row's work, and forget that of the row before."""
        self.clear()
        work, peers = self._work(Contender(row)), BY_NAME[row].peers
        there = {p.name: not p.package or find_spec(p.package) is not None for p in peers}
        installed = tuple(name for name, is_there in there.items() if is_there)
        missing = tuple(name for name, is_there in there.items() if not is_there)
        return Facts(work.size, work.floor, installed, missing)

    def take_turn(self, contender: Contender | CurvePoint, seconds: float) -> Turn:
        """Call a contender's work until the time is up."""
        return take_turn(self._work(contender), seconds)

    def peak_memory_mib(self, row: str) -> float | None:
        """What a row that has run before adds to the memory for its working memory and one call.
        Its input was in memory before, and is not counted."""
        self.clear()
        with AddedMemory() as added:
            work = self._work(Contender(row))
            work.before()
            work.run()
        self.clear()
        return added.mib

    def clear(self) -> None:
        self._made.clear()

    def _work(self, contender: Contender | CurvePoint) -> Work:
        if contender not in self._made:
            self._made[contender] = self._make(contender)
        return self._made[contender]

    def _make(self, contender: Contender | CurvePoint) -> Work:
        if isinstance(contender, CurvePoint):
            return CURVES_BY_NAME[contender.curve].make(self._material, contender.value)
        row = BY_NAME[contender.row]
        by_peer = {peer.name: peer.make for peer in row.peers}
        make = row.make if contender.peer is None else by_peer[contender.peer]
        return make(self._material)


class LaneProcess:
    """A lane in a process of its own, with the methods of `Lane`."""

    def __init__(self, threads: int) -> None:
        self.threads = threads
        # Spawned, not forked: OpenMP's threads do not survive a fork. The initializer's module
        # loads nothing heavy, so that libraries find the number of threads already set.
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(1, context, prepare_worker, (threads,))

    def open(self, path: Path, whole: bool) -> Opened:
        return self.ask(_open, path, whole)

    def live(self, path: Path) -> LiveSummary:
        """Play the recording at its own rate through the pipeline."""
        return self.ask(_play_live, path)

    def facts(self, row: str) -> Facts:
        return self.ask(_on_lane, Lane.facts, row)

    def take_turn(self, contender: Contender | CurvePoint, seconds: float) -> Turn:
        return self.ask(_on_lane, Lane.take_turn, contender, seconds)

    def peak_memory_mib(self, row: str) -> float | None:
        return self.ask(_on_lane, Lane.peak_memory_mib, row)

    def clear(self) -> None:
        self.ask(_on_lane, Lane.clear)

    def ask(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        """Call a function in the process.

        Raises:
            AirgroundError: The process died.
        """
        try:
            with deaf_children():
                future = self._pool.submit(function, *args, **kwargs)
            return future.result()
        except BrokenProcessPool:
            raise AirgroundError("a process died, perhaps for lack of memory") from None

    def close(self) -> None:
        self._pool.shutdown(cancel_futures=True)


@contextmanager
def lane_processes(counts: list[int]) -> Iterator[list[LaneProcess]]:
    """One lane for each number of threads; all of them end with the block."""
    lanes = [LaneProcess(count) for count in counts]
    try:
        yield lanes
    except BaseException:
        end_children()
        raise
    finally:
        for lane in lanes:
            lane.close()


_lanes: list[Lane] = []
"""The one lane of this process."""


def _open(path: Path, whole: bool) -> Opened:
    """Probe the cores before and after playing a recording of both robots."""
    speed = probe()
    recording, config = Recording.open(path), Config()
    warm_up_mapping(config, np.random.default_rng(0))
    settle()
    material, played = play(recording, config, speed.threads, whole)
    _lanes[:] = [Lane(material)]
    return Opened(speed.at_least(probe()), played)


def _on_lane(method: Callable[Concatenate[Lane, P], T], *args: P.args, **kwargs: P.kwargs) -> T:
    return method(_lanes[0], *args, **kwargs)


def _play_live(path: Path) -> LiveSummary:
    recording = Recording.open(path)
    result, _ = run_live(recording, Truth.open(path), Setup(Config()), 0, Playback())
    summary = live_summary(result.table)
    if summary is None:
        raise InputError(f"{path}: too short to be played live")
    return summary
