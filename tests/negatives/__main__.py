"""`python -m tests.negatives --count N`: claims of places that are not there, by the thousand."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

from evaluation.setup.environment import prepare

if TYPE_CHECKING:
    from tests.negatives.campaign import Outcome


def main() -> int:
    prepare(1)
    from airground.config import Config
    from evaluation.show.figures.style import write_png
    from tests.negatives.campaign import MAPS, ORDER, table, tried, tries
    from tests.negatives.flights import flights
    from tests.negatives.kinds import NEGATIVES
    from tests.negatives.picture import tries_figure

    words = argparse.ArgumentParser(prog="python -m tests.negatives", description=__doc__)
    words.add_argument("--count", type=int, default=4000, help="aerial maps without a place")
    words.add_argument("--seed", type=int, default=0, help="seed of everything random")
    words.add_argument("--first", type=int, default=0, help="number of the first case")
    words.add_argument("--heaps", type=int, default=8, help="flights, each over its own heap")
    words.add_argument("--maps", type=Path, default=Path("negatives"), help="folder of their maps")
    words.add_argument("--case", type=int, help="only this case, with every line")
    words.add_argument("--picture", type=Path, help="PNG file of its wrong maps, or of its last")
    words.add_argument("--workers", type=int, default=2, help="processes that try cases")
    asked = words.parse_args()
    least = min(asked.count, asked.heaps, asked.workers)
    if least < 1 or min(asked.seed, asked.first, asked.case or 0) < 0:
        words.error("--count, --heaps and --workers must be at least 1, other numbers at least 0")
    if asked.picture is not None and asked.case is None:
        words.error("--picture is of one case; give --case")
    if asked.picture is not None and not asked.picture.parent.is_dir():
        words.error(f"--picture: there is no folder {asked.picture.parent}")
    flown = flights(asked.heaps, asked.maps)  # made once, for all processes
    if asked.picture is not None:
        made = list(tries(asked.seed, [asked.case], flown, Config()))
        wrong = [one for one in made if one.outcome.is_wrong]
        write_png(tries_figure(wrong or made[-1:]), asked.picture)
    rounds = math.ceil(asked.count / (MAPS * sum(kind in NEGATIVES for kind in ORDER)))
    numbers = range(asked.first, asked.first + rounds * len(ORDER))
    if asked.case is not None:
        numbers = range(asked.case, asked.case + 1)
    found: list[Outcome] = []
    for one in _in_order(
        numbers, asked.workers, partial(tried, asked.seed, asked.heaps, asked.maps)
    ):
        found.append(one)
        if one.is_wrong or asked.case is not None:
            print(one.line(), flush=True)
    print(table(found))
    return int(any(one.is_wrong for one in found))


def _in_order(
    numbers: Sequence[int], workers: int, one: partial[list[Outcome]]
) -> Iterator[Outcome]:
    """The outcomes of cases in their order, whatever the number of processes."""
    # A process that is forked would share the threads of libraries.
    started = get_context("spawn"), prepare, (1,)
    with ProcessPoolExecutor(min(workers, len(numbers)), *started) as pool:
        for outcomes in pool.map(one, numbers, chunksize=4):
            yield from outcomes


if __name__ == "__main__":
    sys.exit(main())
