"""Invalid options of `run --realtime` give a one-line error."""

from __future__ import annotations

from pathlib import Path

import pytest

from evaluation import cli
from evaluation.setup import console


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--split"], "--split: only with --realtime"),
        (["--rate", "2"], "--rate: only with --realtime"),
        (["--realtime", "--rate", "-1"], "--rate -1: must be from 0.01 to 1000"),
        (["--realtime", "--rate", "nan"], "--rate nan: must be"),
        (["--realtime", "--queue", "-1"], "--queue -1: must be"),
        (["--realtime", "--link-loss", "0.1"], "--link-loss: only with --split"),
        (["--realtime", "--split", "--link-loss", "2"], "--link-loss 2: must be from 0 to 1"),
        (["--realtime", "--split", "--link-mbit", "0"], "--link-mbit 0: must be"),
        (["--realtime", "--split", "--link-quality", "0"], "--link-quality 0: must be"),
        (["--realtime", "--split", "--link-latency-ms", "-5"], "--link-latency-ms -5: must be"),
        (["--realtime", "--drops", "dropped.json"], "--drops: without --realtime"),
        (["--only", "mav", "--realtime"], "--only: without --realtime"),
    ],
)
def test_invalid_options_give_a_one_line_error(
    words: list[str], named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as exit_:
        cli.main(["run", "recording", "--out", str(out), *words])
    assert exit_.value.code == console.EXIT_ERROR
    (line,) = capsys.readouterr().err.splitlines()
    assert named in line
    assert not out.exists()
