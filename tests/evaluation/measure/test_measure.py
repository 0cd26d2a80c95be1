"""Each unit is measured once, with any number of workers, even if workers or the run are killed."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import dask
import pytest

from airground.errors import AirgroundError, InputError
from evaluation.measure.work import measure as module
from evaluation.measure.work.crew import Crew
from evaluation.measure.work.measure import NO_FLIGHTS, measure
from evaluation.measure.work.out_folder import LOCK, resumable_folder
from evaluation.measure.work.unit import Finished, Unit, UnitStore
from evaluation.table.rows import ResultTable
from sim.recording.recorder import Flight
from tests.evaluation.measure.fake import (
    DIE,
    DIE_ONCE,
    REFUSE,
    fake_flights,
    fake_units,
    refused,
    runs,
    units_of,
    waiting_for,
    work,
)

DYING = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"
"""What a worker that is killed as it starts runs first."""

ABOUT_WORKERS = pytest.mark.subject(
    "evaluation/measure/work",
    "evaluation/setup",
    "evaluation/table",
    "airground/errors.py",
    but={
        "airground/config.py": "units are made up",
        "evaluation/measure/protocol": "likewise",
        "sim": "flights are named and not flown",
    },
)


@pytest.fixture(autouse=True)
def _fake_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "work", work)


def measured(
    units: list[Unit], out: Path, cores: int = 2, flights: Mapping[Path, Flight] = NO_FLIGHTS
) -> list[Finished]:
    with (
        resumable_folder(out) as folder,
        Crew(None, cores, len(units), folder.scratch) as crew,
    ):
        return measure(units, folder.store, crew, flights)


def table_bytes(found: list[Finished], path: Path) -> bytes:
    ResultTable.concat([unit.table for unit in found]).write(path)
    return path.read_bytes()


def values(found: list[Finished]) -> list[float]:
    return [float(unit.table.frame["value"].iloc[0]) for unit in found]


def test_a_flight_is_measured_once_for_all_its_variants(tmp_path: Path) -> None:
    units = fake_units(tmp_path / "flights", 3)
    # A worker that dies over the first flight costs a second try of it.
    (tmp_path / "flights/flight_0" / DIE_ONCE).touch()
    found = measured(units, tmp_path / "out")
    assert values(found) == [0.05, 0.2, 1.05, 1.2, 2.05, 2.2]
    assert runs(tmp_path / "flights") == [2, 1, 1]
    again = measured(units, tmp_path / "out")
    assert values(again) == values(found)
    assert runs(tmp_path / "flights") == [2, 1, 1]
    assert {file.name for file in (tmp_path / "out").iterdir()} == {LOCK, "units"}


@pytest.mark.slow
@ABOUT_WORKERS
def test_results_do_not_depend_on_the_number_of_workers(tmp_path: Path) -> None:
    units = fake_units(tmp_path / "flights", 5)
    made = {
        table_bytes(measured(units, tmp_path / f"out{cores}", cores), tmp_path / "table")
        for cores in (1, 2, 4)
    }
    assert len(made) == 1
    stored = [
        {file.relative_to(tmp_path / out): file.read_bytes() for file in files}
        for out in ("out1", "out2", "out4")
        for files in [[f for f in (tmp_path / out / "units").rglob("*") if f.is_file()]]
    ]
    assert stored[0] == stored[1] == stored[2]
    assert len(stored[0]) == 2 * len(units)


@pytest.mark.slow
@ABOUT_WORKERS
def test_a_task_that_kills_every_worker_is_an_error(tmp_path: Path) -> None:
    units = fake_units(tmp_path / "flights", 1)
    (tmp_path / "flights/flight_0" / DIE).touch()
    with pytest.raises(AirgroundError, match="4 processes died over the same task"):
        measured(units, tmp_path / "out")
    assert runs(tmp_path / "flights") == [4]
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@ABOUT_WORKERS
def test_workers_that_die_as_they_start_are_an_error(
    tmp_path: Path,
) -> None:
    with (
        dask.config.set({"distributed.worker.preload": [DYING]}),
        Crew(None, 1, 1, tmp_path) as crew,
        pytest.raises(AirgroundError, match="the worker processes did not start"),
    ):
        list(crew.outcomes(str, [1]))


def test_a_flight_is_measured_while_others_are_recorded(tmp_path: Path) -> None:
    flights = fake_flights(tmp_path / "flights", 2)
    first, second = flights
    tmp_path.joinpath("flights").mkdir()
    waiting_for(second).write_text(first.name)
    found = measured(units_of(flights), tmp_path / "out", flights=flights)
    assert values(found) == [0.05, 0.2, 1.05, 1.2]
    assert runs(tmp_path / "flights") == [1, 1]
    # Nothing is recorded or measured again.
    waiting_for(second).write_text("nothing")
    assert values(measured(units_of(flights), tmp_path / "out", flights=flights)) == values(found)
    assert runs(tmp_path / "flights") == [1, 1]


def test_a_unit_waits_for_the_recording_of_the_wrong_map(tmp_path: Path) -> None:
    flights = fake_flights(tmp_path / "flights", 3)
    _, second, third = flights
    tmp_path.joinpath("flights").mkdir()
    waiting_for(second).write_text(third.name)
    units = units_of(flights)
    with_wrong_map = replace(units[0], negatives=True, stranger=second)
    found = measured([with_wrong_map, units[4]], tmp_path / "out", flights=flights)
    assert values(found) == [0.05, 2.05]


def test_a_refused_flight_ends_the_run(tmp_path: Path) -> None:
    flights = fake_flights(tmp_path / "flights", 2)
    first, second = flights
    tmp_path.joinpath("flights").mkdir()
    refused(second).touch()
    with pytest.raises(InputError, match="flight_1 is impossible"):
        measured(units_of(flights), tmp_path / "out", 1, flights)
    assert first.exists()
    refused(second).unlink()
    assert len(measured(units_of(flights), tmp_path / "out", 1, flights)) == 4


def test_a_refused_unit_ends_the_run_and_finished_units_stay(
    tmp_path: Path,
) -> None:
    units = fake_units(tmp_path / "flights", 2)
    refusing = tmp_path / "flights/flight_1" / REFUSE
    refusing.touch()
    with pytest.raises(InputError, match="flight 1 is impossible"):
        measured(units, tmp_path / "out", cores=1)
    assert runs(tmp_path / "flights") == [1, 1]
    refusing.unlink()
    assert len(measured(units, tmp_path / "out", cores=1)) == 4
    assert runs(tmp_path / "flights") == [1, 2]


class FillingDisk:
    """A disk that takes so many tables, and no more."""

    def __init__(self, tables: int) -> None:
        self.left = tables
        self._write = ResultTable.write

    def write(self, table: ResultTable, path: Path) -> None:
        self._write(table, path)
        self.left -= 1
        if self.left < 0:
            path.write_bytes(path.read_bytes()[:100])  # as much as there was room for
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_leaves_complete_units_only(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    units = fake_units(tmp_path / "flights", 3)
    disk = FillingDisk(3)
    with monkeypatch.context() as patch:
        patch.setattr(ResultTable, "write", lambda table, path: disk.write(table, path))
        with pytest.raises(OSError, match="No space left") as error:
            measured(units, tmp_path / "out", cores=1)
    assert str(tmp_path / "out/units") in str(error.value.filename)
    kept = list((tmp_path / "out/units").iterdir())
    assert len(kept) == 3
    for unit in kept:
        ResultTable.read(unit / "rows.parquet")
    # The full disk had taken one of the second flight's two units.
    assert len(measured(units, tmp_path / "out", cores=1)) == 6
    # The third flight may have been under way already when the disk was full.
    assert runs(tmp_path / "flights")[:2] == [1, 2]


@pytest.mark.slow(minutes=1)
@ABOUT_WORKERS
def test_a_killed_run_is_continued(tmp_path: Path) -> None:
    out, flights = tmp_path / "out", tmp_path / "flights"
    command = [sys.executable, "-m", "tests.evaluation.measure.killed_run"]
    process = subprocess.Popen(
        [*command, str(out), str(flights), "6", "0.5", "2"], start_new_session=True
    )
    deadline = time.monotonic() + 600
    while len(list(out.glob("units/[0-9a-f]*"))) < 2:
        assert process.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.05)
    with pytest.raises(InputError, match="another run is writing there"):
        measured([], out)
    process.send_signal(signal.SIGKILL)
    process.wait()
    time.sleep(2)  # its workers notice and end
    kept = {file.name for file in out.glob("units/[0-9a-f]*")}
    before = runs(flights)
    units = fake_units(flights, 6)
    done = [unit.seed for unit in units if unit.key() in kept]
    found = measured(units, out)
    untouched = measured(fake_units(tmp_path / "flights2", 6), tmp_path / "out2")
    assert table_bytes(found, tmp_path / "a") == table_bytes(untouched, tmp_path / "b")
    assert done
    for seed in range(6):
        finished = done.count(seed) == 2  # both variants
        assert runs(flights)[seed] == before[seed] + (not finished)


def test_an_empty_run_starts_no_worker(tmp_path: Path) -> None:
    with Crew("tcp://127.0.0.1:1", 1, 0, tmp_path) as crew:
        assert measure([], UnitStore(tmp_path / "units"), crew) == []
