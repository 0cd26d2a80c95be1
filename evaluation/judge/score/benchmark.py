"""A benchmark's truth on disk: `NAME/recording.toml` and `NAME/truth/` of each recording."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field

from airground import __version__
from airground.errors import InputError
from airground.io.layout import HEADER, TRUTH
from evaluation.setup.checked_json import Count, Part, read_checked
from evaluation.setup.level_mark import LevelMark
from evaluation.setup.output import write_whole

BENCHMARK = "benchmark.json"


class Benchmark(Part):
    """What a set of recordings was made from: the contents of `benchmark.json`, part of the truth.
    `level` is None for recordings of a scene of the user's choice."""

    schema_: Literal[1] = Field(alias="schema")
    airground: str = __version__
    level: LevelMark | None
    seed: Count
    recordings: tuple[str, ...]

    def write(self, folder: Path) -> None:
        text = self.model_dump_json(by_alias=True, indent=1) + "\n"
        write_whole(folder / BENCHMARK, text)


def recordings_in(truth: Path) -> list[Path]:
    """Folders of the truth of each recording, in order of their names.

    Raises:
        InputError: There is none.
    """
    if not truth.is_dir():
        raise InputError(f"{truth}: no such folder; expected what simulate --sealed wrote")
    found = sorted(path.parent for path in truth.glob(f"*/{HEADER}"))
    if not found:
        raise InputError(f"{truth}: holds no recording's truth (NAME/{HEADER}, NAME/{TRUTH}/)")
    return found


def read_benchmark(truth: Path) -> Benchmark | None:
    """What the set was made from; None for a folder of recordings that states nothing.

    Raises:
        InputError: The file is damaged.
    """
    file = truth / BENCHMARK
    return read_checked(Benchmark, file, "benchmark") if file.exists() else None
