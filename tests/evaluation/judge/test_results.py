"""The table of results: read back as written, and nothing lost when it is pivoted."""

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from airground.errors import InputError
from evaluation.setup.condition import Condition, shared_parts, short_labels
from evaluation.table.rows import ResultTable, Row
from tests.evaluation.synthetic_results import BEST, CONDITIONS, DRIFT, PAPER, SCENES, make_table


def _row(value: float, sequence: int, iteration: int, scene: str = "indoor_a") -> Row:
    return Row(
        scene, 1, 0, BEST, "localization", "error_m", value, "m", sequence, iteration, note="why"
    )


def test_a_table_is_read_back_as_written(tmp_path: Path) -> None:
    table = make_table(sequences=2, conditions=(BEST,))
    table.write(tmp_path / "results.parquet")
    pd.testing.assert_frame_equal(ResultTable.read(tmp_path / "results.parquet").frame, table.frame)


@pytest.mark.parametrize("content", [None, b"no parquet"])
def test_an_unreadable_table_is_one_clear_error(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "results.parquet"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=r"results\.parquet: no readable results table"):
        ResultTable.read(path)


def test_damaged_notes_of_pandas_are_one_clear_error(tmp_path: Path) -> None:
    path = tmp_path / "results.parquet"
    make_table(sequences=1, conditions=(BEST,)).write(path)
    notes = pq.read_schema(path).metadata[b"pandas"]
    damaged = {b"pandas": notes.replace(b"pandas_type", b"pandas_tipe")}
    pq.write_table(pq.read_table(path).replace_schema_metadata(damaged), path)
    with pytest.raises(InputError, match=r"results\.parquet: no readable results table"):
        ResultTable.read(path)


def test_a_missing_column_is_named() -> None:
    with pytest.raises(InputError, match="column 'unit' is missing"):
        ResultTable(make_table(sequences=1, conditions=(BEST,)).frame.drop(columns="unit"))


def test_sequences_keep_what_was_not_measured_as_nan() -> None:
    table = ResultTable.from_rows([_row(0.3, 0, 1), _row(0.2, 0, 2), _row(0.5, 1, 1)])
    errors = table.sequences("error_m").to_numpy(float)
    np.testing.assert_array_equal(errors, [[0.3, 0.2], [0.5, np.nan]])
    # A sequence of which only the spread is missing still has its row.
    assert np.isnan(table.sequences("spread_m").to_numpy(float)).all()
    assert len(table.sequences("spread_m")) == 2


def test_the_same_measurement_twice_is_refused() -> None:
    table = ResultTable.from_rows([_row(0.3, 0, 1), _row(0.2, 0, 1)])
    with pytest.raises(ValueError, match="duplicate"):
        table.sequences("error_m")


def test_trials_line_up_across_metrics() -> None:
    trials = make_table(conditions=(BEST,)).scored().trials()
    assert len(trials) == 3 * 2 * 12
    assert {"before_translation_m", "after_translation_m", "accepted"} <= set(trials.columns)
    assert trials.notna().all(axis=None)


def test_conditions_come_in_order_and_select_their_rows() -> None:
    table = make_table(sequences=1)
    assert table.conditions() == list(CONDITIONS)
    parts = [table.of(condition) for condition in CONDITIONS]
    assert sum(map(len, parts)) == len(table)
    assert parts[1].conditions() == [DRIFT]


def test_control_scenes_are_set_apart_unless_they_are_all_there_is() -> None:
    table = make_table(sequences=1, conditions=(BEST,))
    assert table.scored().scenes() == list(SCENES)
    assert table.controls().scenes() == ["flat"]
    assert table.controls().scored().scenes() == ["flat"]


def test_short_labels_name_only_what_differs() -> None:
    assert short_labels([BEST, DRIFT]) == ["exact poses", "poses with drift"]
    assert short_labels([BEST, PAPER]) == ["preset best", "preset paper"]
    assert short_labels([BEST]) == [BEST.label()]
    assert shared_parts([BEST, PAPER]) == "exact poses, nominal sensors, heading known"


def test_a_label_states_every_part_of_the_condition() -> None:
    label = Condition("paper", "oracle with drift", "none", "search", "sigma 1").label()
    assert label == "preset paper (sigma 1), poses with drift, noise-free sensors, heading searched"


def test_a_measurement_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    """Two runs of one flight, put together, have no one value for it."""
    table = make_table(conditions=(BEST,))
    twice = ResultTable.concat([table, table])
    twice.write(tmp_path / "twice.parquet")
    with pytest.raises(InputError, match=r"twice\.parquet: .* is there twice"):
        ResultTable.read(tmp_path / "twice.parquet")


def test_a_column_of_another_type_is_refused(tmp_path: Path) -> None:
    frame = make_table(conditions=(BEST,)).frame
    frame.assign(seed="many").to_parquet(tmp_path / "odd.parquet")
    with pytest.raises(InputError, match=r"odd\.parquet: a column has values of a wrong type"):
        ResultTable.read(tmp_path / "odd.parquet")
