"""Recordings without their truth, which lies in another folder: the data of a benchmark.

A recording `DATA/NAME` is sealed: its header names no scene, seed or dial. `TRUTH/NAME` holds
what was taken out of it: the whole `recording.toml`, and `truth/`.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np

from airground.errors import InputError
from airground.io.header import read_header, write_toml
from airground.io.layout import HEADER, TRUTH
from evaluation.judge.score.benchmark import BENCHMARK, Benchmark, read_benchmark
from evaluation.measure.levels.level import Level
from evaluation.setup.checked_json import read_checked
from evaluation.setup.output import check_free, continued_folder
from evaluation.setup.progress import step
from sim.partial_folder import partial_folder
from sim.recording.recorder import Flight, record

SEALED = "sealed"
"""Name of the scene in the header of a sealed recording."""
TRIES = 8
"""Seeds drawn for one recording, where a level's overlap cannot be had over the first heaps."""


def seal(whole: Path, answers: Path) -> None:
    """Move the truth of a recording, and all of its header that tells it, to another folder.

    Args:
        whole: Folder of a recording that `record` has written; it becomes the sealed one.
        answers: Folder to make.
    """
    answers.mkdir()
    header = read_header(whole / HEADER)
    shutil.copyfile(whole / HEADER, answers / HEADER)
    shutil.move(whole / TRUTH, answers / TRUTH)
    # Numbers of the sealed header are the same in all recordings, for they seed a pipeline's runs.
    bare = header.model_copy(update={"scene": SEALED, "seed": 0, "flight": 0, "dials": None})
    write_toml(whole / HEADER, bare)


def record_sealed(flight: Flight, out: Path, truth: Path, workers: int) -> None:
    """Record one flight; `out` is the sealed recording, and `truth` gets a folder of its name."""
    check_free(out)
    check_free(truth)
    with partial_folder(out) as scratch, partial_folder(truth) as answers:
        whole = _recorded(flight, scratch / "whole", workers)
        seal(whole, answers / out.name)
        Benchmark(schema=1, level=None, seed=flight.seed, recordings=(out.name,)).write(answers)
        answers.rename(truth)
        whole.rename(out)


@dataclass(frozen=True)
class Draw:
    """A set of recordings at a level: `flights` over each of its scenes, by one seed."""

    level: Level
    flights: int
    seed: int

    def tries(self) -> list[list[Flight]]:
        """For each recording, the flights to try until one is possible.

        Every recording has a heap and a seed of its own, and their order tells nothing about the
        scenes.
        """
        rng = np.random.default_rng(self.seed)
        planned = [flight for flight in self.level.flown(1, 0) for _ in range(self.flights)]
        order = rng.permutation(len(planned)).tolist()
        return [
            [replace(planned[i], seed=int(seed)) for seed in rng.integers(2**62, size=TRIES)]
            for i in order
        ]

    def benchmark(self) -> Benchmark:
        """What states the set."""
        names = tuple(f"{number:04d}" for number in range(1, len(self.tries()) + 1))
        return Benchmark(schema=1, level=self.level.mark, seed=self.seed, recordings=names)


def make_benchmark(
    draw: Draw,
    out: Path,
    truth: Path | None,
    workers: int,
    make: Callable[[Flight, Path, int], Path] | None = None,
) -> None:
    """Record a set, and go on with what is missing after an interruption.

    Until all is recorded, both folders are called `.NAME.partial`.

    Args:
        draw: The flights.
        out: Folder of the recordings `0001`, `0002`, ...
        truth: Folder of their truth; None leaves it in the recordings.
        workers: Number of processes that render.
        make: `record` of one flight, by default; for tests.

    Raises:
        InputError: A folder exists, an unfinished one is of another draw, or a flight is
            impossible over every heap that was tried.
    """
    folders = [out] if truth is None else [out, truth]
    data, home = (f.with_name(f".{f.name}.partial") for f in (folders[0], folders[-1]))
    if truth is not None and data.is_dir() and not home.exists() and _states(truth, draw):
        # A killed process had renamed this folder and not yet the other.
        folders, home = [out], truth
    for folder in folders:
        check_free(folder)
    with continued_folder(data), nullcontext() if home == data else continued_folder(home):
        _record_missing(draw, data, home, workers, make or _recorded)
        if truth is not None and home != truth:
            home.rename(truth)
        data.rename(out)


def _states(truth: Path, draw: Draw) -> bool:
    """Whether a folder of truth is of that draw."""
    return truth.is_dir() and read_benchmark(truth) == draw.benchmark()


def _record_missing(
    draw: Draw, data: Path, home: Path, workers: int, make: Callable[[Flight, Path, int], Path]
) -> None:
    """Record what is missing in the unfinished folder `data`; truth goes to `home` if that is
    another."""
    benchmark = draw.benchmark()
    _agree(benchmark, home)
    missing = [
        (name, tries)
        for name, tries in zip(benchmark.recordings, draw.tries(), strict=True)
        if not (data / name).exists()
    ]
    done = len(benchmark.recordings) - len(missing)
    with step("recording", len(benchmark.recordings), "flights", done) as recording:
        for name, tries in missing:
            with partial_folder(data / name) as scratch:
                whole = _first_possible(tries, scratch / "whole", workers, make)
                if home != data:
                    # Of a killed process: without the recording it is worth nothing.
                    shutil.rmtree(home / name, ignore_errors=True)
                    seal(whole, home / name)
                whole.rename(data / name)
            recording.advance()


def _agree(benchmark: Benchmark, home: Path) -> None:
    """Write what the set is made from, or check that it is what is written there."""
    written = home / BENCHMARK
    if not written.exists():
        benchmark.write(home)
    elif read_checked(Benchmark, written, "benchmark") != benchmark:
        raise InputError(
            f"{home}: is the unfinished work of another level, seed, size or version; remove it, "
            "or give the same words"
        )


def _first_possible(
    tries: list[Flight], whole: Path, workers: int, make: Callable[[Flight, Path, int], Path]
) -> Path:
    """Record the first flight that is possible."""
    for flight in islice(tries, len(tries) - 1):
        try:
            return make(flight, whole, workers)
        except InputError:
            continue
    return make(tries[-1], whole, workers)


def _recorded(flight: Flight, out: Path, workers: int) -> Path:
    return record(
        flight.scene,
        flight.seed,
        flight.sensors,
        out,
        flight.duration_s,
        workers,
        flight=flight.flight,
        dials=flight.dials,
    )
