"""A run of fake units in a process of its own: `python -m ... OUT FLIGHTS COUNT PAUSE_S CORES`."""

from __future__ import annotations

import sys
from pathlib import Path

from evaluation.measure.work import measure as module
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.out_folder import resumable_folder
from evaluation.setup import console
from tests.evaluation.measure import fake


def main(out: str, flights: str, count: str, pause_s: str, cores: str) -> None:
    module.work = fake.work
    units = fake.fake_units(Path(flights), int(count), float(pause_s))
    with (
        resumable_folder(Path(out)) as folder,
        Crew(None, int(cores), len(units), folder.scratch) as crew,
    ):
        found = module.measure(units, folder.store, crew)
        (folder.results / "count").write_text(str(len(found)))


if __name__ == "__main__":
    sys.exit(console.run(lambda: main(*sys.argv[1:])))
