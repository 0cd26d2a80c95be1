"""One row per measured value: experiments write them, reports read them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pyarrow import ArrowException

from airground.errors import InputError
from airground.io.input_files import check_file
from evaluation.setup.condition import Condition

CONTROL_SCENES = frozenset({"flat"})
"""Scenes without structure, in which the right answer is to claim nothing."""
OUTDOOR_SCENES = frozenset({"meadow", "outdoor", "paper_outdoor", "street"})
UNSCORED_SCENES = CONTROL_SCENES | {"paper_outdoor"}
"""Scenes that count in no accuracy: controls, and the twin of the paper's outdoor dataset, for
which the paper has pictures and no truth."""

CLOCK_STAGES = frozenset({"timing", "run"})
"""Stages whose rows depend on the machine and on what else it does."""

ALIGNMENT_STAGE = "alignment"
"""Stage of the pipeline's own alignments, by sighting; that of trials is "refinement"."""

LIVE_STAGE = "realtime"
"""Of rows that only a live run writes."""
SEQUENCE_KEYS = ["scene", "seed", "flight", "sequence"]
TRIAL_KEYS = ["scene", "seed", "flight", "sequence", "trial"]

_DTYPES = {
    "scene": "string",
    "seed": "Int64",
    "flight": "Int64",
    "preset": "string",
    "poses": "string",
    "sensors": "string",
    "heading": "string",
    "variant": "string",
    "sequence": "Int64",
    "iteration": "Int64",
    "trial": "Int64",
    "stage": "string",
    "metric": "string",
    "value": "float64",
    "unit": "string",
    "note": "string",
    "time_s": "float64",
}

_UNREADABLE = (OSError, ValueError, TypeError, LookupError, AttributeError, ArrowException)
"""What pandas raises for a damaged file, whose notes on its own columns it does not check."""
_MEASURED = ("value", "unit", "note", "time_s")
"""Columns that do not tell measurements apart."""


@dataclass(frozen=True)
class Row:
    """One measured value.

    Attributes:
        scene, seed, flight: The recording.
        condition: The condition of the measurement.
        stage, metric, value, unit: The measurement; NaN where a failure left no number.
        sequence, iteration, trial: Their numbers, where that applies; iterations count from 1.
        note: A reason in words, for example of a refusal.
        time_s: Of a value that is measured over time, time since the first image; of a belief or an
            alignment, stamp of its surface on the sensors' clock [s].
    """

    scene: str
    seed: int
    flight: int
    condition: Condition
    stage: str
    metric: str
    value: float
    unit: str
    sequence: int | None = None
    iteration: int | None = None
    trial: int | None = None
    note: str = ""
    time_s: float | None = None


@dataclass(frozen=True, eq=False)
class ResultTable:
    """Rows of measurements as a data frame with fixed columns; treat it as read-only."""

    frame: pd.DataFrame

    def __post_init__(self) -> None:
        missing = [name for name in _DTYPES if name not in self.frame.columns]
        if missing:
            raise InputError(f"results: column {missing[0]!r} is missing; expected {list(_DTYPES)}")
        frame = self.frame[list(_DTYPES)].astype(_DTYPES).reset_index(drop=True)
        object.__setattr__(self, "frame", frame)

    @classmethod
    def from_rows(cls, rows: Iterable[Row]) -> ResultTable:
        # Column by column: as records, rows would take almost three times the memory.
        kept = list(rows)
        of_condition = Condition.__dataclass_fields__
        columns = {
            name: [getattr(row.condition if name in of_condition else row, name) for row in kept]
            for name in _DTYPES
        }
        return cls(pd.DataFrame(columns))

    @classmethod
    def concat(cls, tables: Sequence[ResultTable]) -> ResultTable:
        return cls(pd.concat([table.frame for table in tables], ignore_index=True))

    @classmethod
    def read(cls, path: Path) -> ResultTable:
        """Read `results.parquet`; raises InputError if the file is missing, no parquet, or lacks a
        column."""
        try:
            check_file(path)
            frame = pd.read_parquet(path)
        except (*_UNREADABLE, MemoryError) as error:
            raise InputError(f"{path}: no readable results table ({error})") from error
        try:
            table = cls(frame)
            for name in (name for name, kind in _DTYPES.items() if kind == "string"):
                table.frame[name].unique().tolist()  # decodes the texts, which may be damaged
        except (TypeError, ValueError, OverflowError, MemoryError, ArrowException) as error:
            raise InputError(f"{path}: a column has values of a wrong type ({error})") from None
        table.check_once(str(path))
        return table

    def check_once(self, origin: str) -> None:
        """Raise InputError, naming `origin`, if a numbered measurement is there twice."""
        frame = self.frame
        numbered = frame[frame[["sequence", "iteration", "trial"]].notna().any(axis=1)]
        again = numbered[numbered.duplicated([name for name in _DTYPES if name not in _MEASURED])]
        if len(again):
            row = again.iloc[0]
            raise InputError(
                f"{origin}: {row['stage']} {row['metric']} of scene {row['scene']}, seed "
                f"{row['seed']}, flight {row['flight']} is there twice; expected once"
            )

    def write(self, path: Path) -> None:
        # As bytes: where the folder is gone, pandas makes an error without a number.
        path.write_bytes(self.frame.to_parquet(index=False))

    def __len__(self) -> int:
        return len(self.frame)

    def conditions(self) -> list[Condition]:
        """Every condition, in the order of first appearance."""
        columns = list(Condition.__dataclass_fields__)
        unique = self.frame[columns].drop_duplicates()
        return [Condition(*map(str, row)) for row in unique.itertuples(index=False)]

    def scenes(self) -> list[str]:
        return [str(scene) for scene in self.frame["scene"].unique()]

    def of(self, condition: Condition) -> ResultTable:
        """The rows measured under one condition."""
        keep = pd.Series(True, index=self.frame.index)
        for column, value in asdict(condition).items():
            keep &= self.frame[column] == value
        return ResultTable(self.frame[keep])

    def of_scenes(self, scenes: Iterable[str]) -> ResultTable:
        return ResultTable(self.frame[self.frame["scene"].isin(list(scenes))])

    def without(self, stages: Iterable[str]) -> ResultTable:
        """Without the rows of some stages."""
        return ResultTable(self.frame[~self.frame["stage"].isin(list(stages))])

    def scored(self) -> ResultTable:
        """Without the unscored scenes, unless there are no others. Where there is nothing to find,
        being lost is no failure; such scenes are judged by `controls` instead."""
        others = [scene for scene in self.scenes() if scene not in UNSCORED_SCENES]
        return self.of_scenes(others) if others else self

    def outdoors(self) -> ResultTable:
        """Only the outdoor scenes."""
        return self.of_scenes(OUTDOOR_SCENES)

    def indoors(self) -> ResultTable:
        """Neither outdoor nor control scenes."""
        others = OUTDOOR_SCENES | CONTROL_SCENES
        return self.of_scenes(scene for scene in self.scenes() if scene not in others)

    def controls(self) -> ResultTable:
        """Only the control scenes."""
        return self.of_scenes(CONTROL_SCENES)

    def rows(self, stage: str, metric: str) -> pd.DataFrame:
        return self.frame[(self.frame["stage"] == stage) & (self.frame["metric"] == metric)]

    def values(self, stage: str, metric: str) -> NDArray[np.float64]:
        """(N,) every value of one metric, in the order of the table."""
        return self.rows(stage, metric)["value"].to_numpy(np.float64)

    def sequences(self, metric: str) -> pd.DataFrame:
        """A localization metric per sequence (rows) and iteration (columns 1, 2, ...).
        There is a row for every sequence in the table, and a column for every iteration up to that
        of the longest sequence; what was not measured is NaN."""
        frame = self.frame[self.frame["stage"] == "localization"]
        keys = frame[SEQUENCE_KEYS].drop_duplicates()
        last = frame["iteration"].max()
        columns = range(1, 1 if pd.isna(last) else int(last) + 1)
        wanted = frame[frame["metric"] == metric]
        wide = wanted.pivot(index=SEQUENCE_KEYS, columns="iteration", values="value")
        return wide.reindex(index=pd.MultiIndex.from_frame(keys), columns=columns)

    def trials(self) -> pd.DataFrame:
        """The refinement's metrics per trial: one row a trial, one column a metric."""
        frame = self.frame[self.frame["stage"] == "refinement"]
        keyed = frame.assign(**{key: frame[key].fillna(-1) for key in TRIAL_KEYS[1:]})
        return keyed.pivot(index=TRIAL_KEYS, columns="metric", values="value")
