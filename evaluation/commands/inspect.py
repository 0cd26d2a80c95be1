"""`airground inspect`: what is in a dataset, and what is wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import Positional, arg

from evaluation.commands.words import Verb


@dataclass(frozen=True, kw_only=True)
class Inspect(Verb):
    """Say what is in a dataset, and what is wrong with it.

    For recordings of ours, datasets of many, EuRoC and TUM RGB-D folders: digests, rates, gaps,
    calibration, and whether the true poses fit the images. Exits with 1 if something is wrong.
    """

    dataset: Annotated[Positional[Path], arg(metavar="DATASET")]
    """The folder."""
    calibration: Annotated[
        Path | None, arg(metavar="FILE", help_behavior_hint="(default: the folder's own)")
    ] = None
    """Camera calibration of a plain folder, in the form of EuRoC's sensor.yaml."""
    json: bool = False
    """Print JSON in place of a table."""

    def main(self) -> int:
        from evaluation.datasets.inspection.findings import Verdict, as_json, show
        from evaluation.datasets.inspection.inspect_dataset import inspect_dataset

        layout, findings = inspect_dataset(self.dataset, self.calibration)
        if self.json:
            print(as_json(str(self.dataset), layout, findings))
        else:
            show(f"{self.dataset} ({layout})", findings)
        return int(any(finding.verdict is Verdict.WRONG for finding in findings))
