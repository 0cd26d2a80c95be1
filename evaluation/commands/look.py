"""`airground run --rerun`: what of a run can be looked into afterwards, or while it runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from airground.errors import InputError

if TYPE_CHECKING:
    from airground.core.cloud import Source
    from airground.core.messages import RobotCalibration
    from evaluation.run.onlooker import Onlooker
    from sim.recording.truth import Truth


@dataclass(frozen=True, kw_only=True)
class LookWords:
    """What is drawn of a run."""

    rerun: bool = False
    """Leave run.rrd, for `airground view`, and the pictures that gallery draws."""
    rerun_live: bool = False
    """As --rerun, and show it as it happens: in a window, or in a browser without a screen."""
    rerun_level: Literal["summary", "stages", "all"] = "stages"
    """How much run.rrd keeps of each second: docs/look_into_a_run.md has the sizes."""

    def check_look_words(self, alone: bool, realtime: bool) -> None:
        """Raises InputError where a word has no meaning."""
        if self.rerun_level != "stages" and not self.looks:
            raise InputError("--rerun-level: only with --rerun or --rerun-live")
        if self.looks and alone:
            raise InputError("--rerun: shows both robots; leave --only out")
        if self.looks and realtime:
            raise InputError(
                "--rerun: drawing would slow a live run down; run it again without --realtime, "
                "with --drops DIR/dropped.json, which gives the same result"
            )

    @property
    def looks(self) -> bool:
        """Whether anything is drawn."""
        return self.rerun or self.rerun_live

    @contextmanager
    def watching(
        self,
        folder: Path,
        name: str,
        calibrations: Mapping[Source, RobotCalibration],
        truth: Truth | None,
    ) -> Iterator[list[Onlooker]]:
        """Who draws the run into a folder, while the block runs; nobody where not asked for."""
        if not self.looks:
            yield []
            return
        from evaluation.show.rerun_view.run_view import RUN_FILE, RunView

        with ExitStack() as stack:
            viewer = stack.enter_context(_viewer()) if self.rerun_live else None
            view = RunView(folder / RUN_FILE, name, calibrations, truth, self.rerun_level, viewer)
            stack.callback(view.close)
            yield [view]


@contextmanager
def _viewer() -> Iterator[str]:
    """A viewer that waits for data; gives its address."""
    from evaluation.show.rerun_view import viewer

    ports = viewer.free_ports()
    if viewer.has_screen():
        with viewer.window(ports):
            yield ports.sink
        return
    with viewer.serving(ports):
        print(f"live in a browser: {ports.page}")
        yield ports.sink
