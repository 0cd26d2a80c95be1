"""A lane: one process with so many cores, which holds the material and takes turns."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from airground.config import Config
from airground.io.recording import Recording
from airground.warm_up import warm_up_mapping
from evaluation.bench.curves import CURVES_BY_NAME, CurvePoint
from evaluation.bench.material import Material, Played, play
from evaluation.bench.memory import peak_memory_mib
from evaluation.bench.probe import probe
from evaluation.bench.row import Contender, Floor, Speed, Work
from evaluation.bench.rows import BY_NAME
from evaluation.bench.sampler import Turn, take_turn
from evaluation.setup.environment import settle


@dataclass(frozen=True)
class Opened:
    """What a lane found out while it made its material.

    Attributes:
        speed: What its cores can do.
        played: The pipeline's run over the recording; None where it was not played to its end.
        peak_memory_mib: That this added, in all processes; None where nobody counts it.
    """

    speed: Speed
    played: Played | None
    peak_memory_mib: float | None


@dataclass(frozen=True)
class Facts:
    """What is known of a row before it is timed.

    Attributes:
        size: How large its work is, in words.
        floor: The least that it takes; None where nobody can say.
        peers: Those whose package is installed.
        missing: Names of the others.
    """

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
        self._made.clear()
        work = self._work(Contender(row))
        peers = BY_NAME[row].peers
        there = {p.name for p in peers if importlib.util.find_spec(p.package) is not None}
        return Facts(
            work.size,
            work.floor,
            tuple(peer.name for peer in peers if peer.name in there),
            tuple(peer.name for peer in peers if peer.name not in there),
        )

    def take_turn(self, contender: Contender | CurvePoint, seconds: float) -> Turn:
        """Call a contender's work until the time is up."""
        return take_turn(self._work(contender), seconds)

    def peak_memory_mib(self, row: str) -> float | None:
        """What a row needs for its working memory and one call; it must have run before.

        What it works on was there before, and is not counted.
        """
        self._made.clear()

        def fresh() -> None:
            work = self._work(Contender(row))
            work.before()
            work.run()

        peak = peak_memory_mib(fresh)
        self._made.clear()
        return peak

    def clear(self) -> None:
        """Forget what was made."""
        self._made.clear()

    def _work(self, contender: Contender | CurvePoint) -> Work:
        if contender not in self._made:
            self._made[contender] = self._make(contender)
        return self._made[contender]

    def _make(self, contender: Contender | CurvePoint) -> Work:
        if isinstance(contender, CurvePoint):
            return CURVES_BY_NAME[contender.curve].make(self._material, contender.value)
        row = BY_NAME[contender.row]
        make = row.make if contender.peer is None else row.peer(contender.peer).make
        return make(self._material)


def open_lane(path: Path, whole: bool) -> tuple[Lane, Opened]:
    """Probe the cores before and after playing the recording.

    Args:
        path: A recording of both robots.
        whole: Play it to its end.
    """
    speed = probe()
    recording, config = Recording.open(path), Config()
    warm_up_mapping(config, np.random.default_rng(0))
    settle()
    kept: list[tuple[Material, Played | None]] = []
    peak = peak_memory_mib(lambda: kept.append(play(recording, config, whole)))
    material, played = kept[0]
    if peak is not None and played is not None:
        peak += played.tracking_memory_mib
    return Lane(material), Opened(speed.at_least(probe()), played, peak)
