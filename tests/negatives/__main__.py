"""`python -m tests.negatives --count N`: claims of places that are not there, by the thousand."""

from __future__ import annotations

import argparse
import sys
from itertools import count as count_up
from pathlib import Path

from evaluation.setup.environment import prepare


def main() -> int:
    prepare(1)
    from airground.config import Config
    from tests.negatives.campaign import ORDER, outcomes, table
    from tests.negatives.flights import flights
    from tests.negatives.kinds import NEGATIVES

    words = argparse.ArgumentParser(prog="python -m tests.negatives", description=__doc__)
    words.add_argument("--count", type=int, default=4000, help="aerial maps without a place")
    words.add_argument("--seed", type=int, default=0, help="seed of everything random")
    words.add_argument("--first", type=int, default=0, help="number of the first case")
    words.add_argument("--heaps", type=int, default=8, help="flights, each over its own heap")
    words.add_argument("--maps", type=Path, default=Path("negatives"), help="folder of their maps")
    words.add_argument("--case", type=int, help="only this case, with every line")
    asked = words.parse_args()
    if min(asked.count, asked.heaps) < 1 or min(asked.seed, asked.first, asked.case or 0) < 0:
        words.error("--count and --heaps must be at least 1, other numbers at least 0")
    flown = flights(asked.heaps, asked.maps)
    found, tried = [], 0
    numbers = count_up(asked.first) if asked.case is None else [asked.case]
    for number in numbers:
        for one in outcomes(asked.seed, [number], flown, Config()):
            found.append(one)
            tried += one.kind in NEGATIVES
            if one.is_wrong or asked.case is not None:
                print(one.line(), flush=True)
        if tried >= asked.count and number % len(ORDER) == len(ORDER) - 1:
            break
    print(table(found))
    return int(any(one.is_wrong for one in found))


if __name__ == "__main__":
    sys.exit(main())
