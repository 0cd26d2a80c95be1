"""`python -m tests.fuzz --count N --seed S`: damaged inputs, and what became of them."""

from __future__ import annotations

import argparse
import sys

from evaluation.setup.environment import prepare
from tests.fuzz.campaign import outcomes, table


def main() -> int:
    prepare(1)
    words = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    words.add_argument("--count", type=int, default=1000, help="number of inputs")
    words.add_argument("--seed", type=int, default=0, help="seed of everything random")
    words.add_argument("--first", type=int, default=0, help="number of the first, to repeat one")
    asked = words.parse_args()
    found = []
    for one in outcomes(asked.seed, range(asked.first, asked.first + asked.count)):
        found.append(one)
        if one.is_finding or asked.count == 1:
            print(f"#{one.number} {one.subject}: {one.damage} in {one.file}: {one.verdict}")
            print(one.words, flush=True)
    print(table(found))
    return int(any(one.is_finding for one in found))


if __name__ == "__main__":
    sys.exit(main())
