"""A run of fake units in a process of its own, to be killed: `python -m ... OUT FLIGHTS CORES`."""

from __future__ import annotations

import sys
from pathlib import Path

from evaluation.units import measure as module
from evaluation.units.crew import Crew
from evaluation.units.out_folder import resumable_folder
from tests.evaluation.units import fake

FLIGHTS, PAUSE_S = 6, 0.5


def main(out: Path, flights: Path, cores: int) -> None:
    module.work = fake.work
    units = fake.fake_units(flights, FLIGHTS, PAUSE_S)
    with (
        resumable_folder(out) as folder,
        Crew(None, cores, len(units), folder.scratch) as crew,
    ):
        found = module.measure(units, folder.store, crew)
        (folder.results / "count").write_text(str(len(found)))


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))
