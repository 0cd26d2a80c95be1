"""What is compared of two outputs, and what is not."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from tests.kills.same import compared, differences, lacks_a_robot

ROWS = [("timing", 14.0), ("run", 30.0), ("realtime", 5.0), ("localization", 0.25)]


def output(folder: Path, clock: float = 0.0, error: float = 0.0) -> Path:
    """An output whose times and errors are off by so much."""
    for name in ("figures", "tables", "units/key"):
        (folder / name).mkdir(parents=True)
    values = [value + (error if stage == "localization" else clock) for stage, value in ROWS]
    table = pd.DataFrame({"stage": [stage for stage, _ in ROWS], "value": values})
    for name in ("results.parquet", "units/key/rows.parquet"):
        table.to_parquet(folder / name, index=False)
    summary = {"timing_ms": clock, "real_time_factor": clock, "realtime": clock, "error_m": error}
    (folder / "summary.json").write_text(json.dumps(summary))
    speed = f"recorded over processing seconds & {clock}"
    (folder / "tables/comparison.tex").write_text(f"error & {error} \\\\\n{speed} \\\\\n")
    for name in ("report.html", "figures/table1_timing.csv", "tables/timing.tex", "mav_live.tum"):
        (folder / name).write_text(f"{clock} {error}")
    for name in ("mav.tum", "augmented_map.ply", "figures/fig11.png"):
        (folder / name).write_text(f"{error}")
    return folder


def test_times_make_no_difference(tmp_path: Path) -> None:
    one, other = output(tmp_path / "a"), output(tmp_path / "b", clock=1.0)
    assert differences("live", one, other) == []
    assert differences("run", one, other) == ["mav_live.tum differs"]
    assert len(differences("export", one, other)) == 8


def test_results_make_one_each(tmp_path: Path) -> None:
    one, other = output(tmp_path / "a"), output(tmp_path / "b", error=0.01)
    wrong = [line.removesuffix(" differs") for line in differences("live", one, other)]
    assert wrong == compared("live", one)[0]
    assert wrong == [
        "augmented_map.ply",
        "figures/fig11.png",
        "mav.tum",
        "results.parquet",
        "summary.json",
        "tables/comparison.tex",
        "units/key/rows.parquet",
    ]


@pytest.mark.parametrize("name", ["report.html", "mav.tum", ".hidden"])
def test_a_file_in_one_only_is_a_difference(name: str, tmp_path: Path) -> None:
    one, other = output(tmp_path / "a"), output(tmp_path / "b")
    (one / name).unlink(missing_ok=True)
    if name == ".hidden":
        (other / name).touch()
    assert differences("live", one, other) == [f"{name} is in one only"]


def test_a_live_run_without_a_robot_says_so(tmp_path: Path) -> None:
    summary = tmp_path / "summary.json"
    assert not lacks_a_robot(tmp_path)
    for live, expected in ((None, False), ((1, 1), False), ((0, 1), True)):
        robots = live and {"mav": {"survived": live[0]}, "ground": {"survived": live[1]}}
        summary.write_text(json.dumps({"realtime": robots}))
        assert lacks_a_robot(tmp_path) == expected
