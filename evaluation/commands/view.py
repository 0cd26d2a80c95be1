"""`airground view`: look into a run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from airground.errors import InputError
from evaluation.commands.words import Verb


@dataclass(frozen=True, kw_only=True)
class View(Verb):
    """Look into a run with rerun: in a window, in a browser, or as a file to send.

    Everything listens on this machine only; over SSH, forward the ports that --serve names.
    """

    run: Annotated[Positional[Path], arg(metavar="RUN")]
    """A folder that run --rerun has written, or its run.rrd."""
    serve: bool = False
    """Serve the viewer for a browser, until Ctrl-C."""
    save: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(optional)")] = None
    """Write one .rrd file that opens with the layout in any viewer of rerun."""

    def main(self) -> int | None:
        from evaluation.show.rerun_view import viewer

        if self.serve and self.save is not None:
            raise InputError("--serve and --save: give one of them")
        file = rerun_file(self.run)
        viewer.verify(file)
        if self.save is not None:
            viewer.save(file, self.save)
            return None
        if self.serve:
            return self._serve(file)
        if not viewer.has_screen():
            raise InputError(
                "no screen here: --serve shows it in a browser, --save FILE takes it elsewhere"
            )
        return viewer.show(file)

    def _serve(self, file: Path) -> int:
        from evaluation.show.rerun_view import viewer

        ports = viewer.free_ports()
        with viewer.serving(ports, file) as server:
            print(f"in a browser: {ports.page}")
            forwards = " ".join(f"-L {port}:localhost:{port}" for port in (ports.web, ports.data))
            print(f"over SSH, first: ssh {forwards} HOST", flush=True)
            return server.wait()


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
