"""`airground view` and `gallery`: what a run has kept, in rerun or as pictures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, create_mutex_group

from airground.core.scratch_folder import ScratchFolder
from airground.errors import AirgroundError, InputError
from evaluation.commands.options import OutOption, Shown, Verb
from evaluation.commands.results import ACCEPTED

IN_PLACE_OF_A_WINDOW = create_mutex_group(required=False)
MOST_RUNS = 2

if TYPE_CHECKING:
    from evaluation.measure.showcase import Showcase


@dataclass(frozen=True, kw_only=True)
class View(Verb):
    """Look into a run with rerun: in a window, a browser, or as a file.

    Two runs over one recording are drawn on one clock, from the first difference on, which a table
    names. Everything listens on this machine only; over SSH, forward the ports that --serve names.
    """

    runs: Annotated[Positional[tuple[Path, ...]], Shown("RUN [RUN]")]
    """folder that run --rerun has written, or its run.rrd; two to compare them"""
    at: Annotated[float | None, Shown("SECONDS")] = None
    """open one run at this moment of the sensors, and wait there [plays from its start]"""
    serve: Annotated[bool, IN_PLACE_OF_A_WINDOW] = False
    """serve the viewer for a browser, until Ctrl-C"""
    save: Annotated[Path | None, IN_PLACE_OF_A_WINDOW, Shown("FILE")] = None
    """write one .rrd file that any viewer of rerun opens"""

    def main(self) -> None:
        from evaluation.setup.output import check_new_file
        from evaluation.show.rerun_view import viewer

        files = rerun_files(self.runs)
        for file in files:
            viewer.verify(file)
        if self.save is not None:
            check_new_file(self.save, "--save")
        elif not self.serve and not viewer.has_screen():
            raise InputError(
                "no screen here: --serve shows it in a browser, --save FILE takes it elsewhere"
            )
        with shown_file(files, self.at) as shown:
            self._show(shown)

    def _show(self, file: Path) -> None:
        from evaluation.show.rerun_view import viewer

        if self.save is not None:
            viewer.save(file, self.save)
        elif self.serve:
            self._serve(file)
        else:
            _check_end(viewer.show(file))

    def _serve(self, file: Path) -> None:
        from evaluation.show.rerun_view import viewer

        ports = viewer.free_ports()
        with viewer.serving(ports, file) as server:
            print(f"in a browser: {ports.page}")
            forwards = " ".join(f"-L {port}:localhost:{port}" for port in (ports.web, ports.data))
            print(f"over SSH, first: ssh {forwards} HOST", flush=True)
            _check_end(server.wait())


@contextmanager
def shown_file(files: Sequence[Path], at_s: float | None = None) -> Iterator[Path]:
    """The file to show: that of the only run, a copy of it that opens at `at_s` [s], or one of both
    runs, whose first differences are printed.

    Raises:
        InputError: The run has nothing at that time, or two runs cannot be held against each other.
    """
    if len(files) == 1 and at_s is None:
        yield files[0]
    elif at_s is None:
        with _both(files) as both:
            yield both
    elif len(files) == 1:
        from evaluation.show.rerun_view.one_moment import write_from
        from evaluation.show.rerun_view.trace import RunFile

        with ScratchFolder() as folder:
            moment = folder.path / "moment.rrd"
            write_from(RunFile.open(files[0], files[0].parent.name), at_s, moment)
            yield moment
    else:
        raise InputError("--at is for one run; two open at their first difference")


@contextmanager
def _both(files: Sequence[Path]) -> Iterator[Path]:
    """Two runs in one file; prints their first differences."""
    from evaluation.judge.runs import distinct_names
    from evaluation.setup.progress import step
    from evaluation.show.rerun_view.differences import hold_files, print_differences
    from evaluation.show.rerun_view.run_view import RUN_FILE
    from evaluation.show.rerun_view.trace import RunFile
    from evaluation.show.rerun_view.two_runs import write_both

    named = [file.parent if file.name == RUN_FILE else file for file in files]
    first, second = map(RunFile.open, files, distinct_names(named))
    with ScratchFolder() as folder:
        both = folder.path / "two_runs.rrd"
        with step("comparing the runs"):
            helds = hold_files(first, second, ACCEPTED)
            write_both(first, second, helds, both)
        print_differences(helds, first.name, second.name)
        yield both


def _check_end(code: int) -> None:
    if code:
        raise AirgroundError(f"the viewer ended with exit code {code}")


def rerun_files(runs: Sequence[Path]) -> list[Path]:
    """The .rrd files of one run, or of two different ones.

    Raises:
        InputError: There are more or none, one twice, or one without a file.
    """
    if not 1 <= len(runs) <= MOST_RUNS:
        raise InputError(f"{len(runs)} runs given; expected one RUN, or two over one recording")
    files = [rerun_file(run) for run in runs]
    if len({file.resolve() for file in files}) < len(files):
        raise InputError(f"{runs[0]}: given twice; give two different runs")
    return files


def rerun_file(run: Path) -> Path:
    """The .rrd file of a run.

    Raises:
        InputError: There is none.
    """
    from evaluation.show.rerun_view.run_view import RUN_FILE

    if run.is_file():
        return run
    if not run.is_dir():
        raise InputError(f"{run}: no such folder; expected what run --rerun wrote")
    if not (run / RUN_FILE).is_file():
        raise InputError(
            f"{run}: has no {RUN_FILE}; run the recording again with --rerun to look into it"
        )
    return run / RUN_FILE


@dataclass(frozen=True, kw_only=True)
class Gallery(OutOption, Verb):
    """Draw the pictures of a run as PNG files: maps, depth, costs, particles, errors.

    They are those of the report, drawn from what run --rerun or reproduce has kept.
    """

    run: Annotated[Positional[Path], Shown("RUN")]
    """folder that run --rerun or reproduce has written"""
    animation: bool = False
    """also draw how the first aerial surface finds its place, as an animated WebP"""

    def main(self) -> None:
        from evaluation.judge.results import TABLE, read_results
        from evaluation.setup.output import fresh_folder
        from evaluation.setup.progress import step
        from evaluation.show.figures.style import save_picture
        from evaluation.show.report.figures import report_figures

        if self.run.is_dir() and not (self.run / TABLE).exists():
            raise InputError(
                f"{self.run}: has no {TABLE}, so nothing in it was held against a truth; "
                "airground view shows what run --rerun has kept"
            )
        results = read_results(self.run)
        if results.showcase is None:
            raise InputError(f"{self.run}: keeps no pictures; run the recording again with --rerun")
        with fresh_folder(self.out) as folder, step("drawing"):
            table = results.table
            for drawn in report_figures(table, table.conditions(), results.showcase):
                save_picture(drawn.figure, folder, drawn.name)
                print(f"{drawn.name}.png: {drawn.title}")
            if self.animation:
                self._animate(folder, results.showcase)

    def _animate(self, folder: Path, showcase: Showcase) -> None:
        from evaluation.show.figures.landing import save_landing

        if showcase.T_ground_mav is None:
            raise InputError(f"{self.run}: --animation: its surface was not aligned")
        save_landing(folder / "landing.webp", showcase, showcase.T_ground_mav)
        print("landing.webp: the first aerial surface finds its place")
