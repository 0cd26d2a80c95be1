"""Runs as compare reads them, from made-up results."""

from __future__ import annotations

from airground.config import Config
from evaluation.judge.accepted import Measured
from evaluation.judge.runs import Run
from evaluation.judge.summary import Summary, build_summary
from evaluation.setup.condition import RunInfo
from evaluation.table.rows import ResultTable

INFO = RunInfo("0.1.0", "abc123", 0, "some CPU", 2)


def made_run(
    name: str,
    table: ResultTable,
    info: RunInfo = INFO,
    config: Config | None = None,
    summary: Summary | None = None,
) -> Run:
    """A run of which this is the table, and the first condition the primary one."""
    summary = summary or build_summary(table, table.conditions()[0], info)
    return Run(name, table, config or Config(), summary, Measured.of(table))
