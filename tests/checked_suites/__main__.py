"""`python -m tests.checked_suites keep|sample RESULTS`."""

from __future__ import annotations

import sys
from pathlib import Path

from airground.errors import InputError
from evaluation.setup.console import run
from evaluation.setup.environment import prepare


def main() -> int:
    prepare()
    from tests.checked_suites.figures import keep
    from tests.checked_suites.sample import sample

    commands = {"keep": keep, "sample": sample}
    if len(sys.argv) != 3 or sys.argv[1] not in commands:
        raise InputError("usage: python -m tests.checked_suites keep|sample RESULTS")
    return commands[sys.argv[1]](Path(sys.argv[2]))


if __name__ == "__main__":
    sys.exit(run(main))
