"""Invalid options of `live` give a one-line error; options of the radio imply the radio."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from evaluation import cli
from evaluation.commands.live import Live
from evaluation.run.live.radio_link import RadioLimits
from evaluation.setup import console


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--rate", "-1"], "--rate -1: must be from 0.01 to 1000"),
        (["--rate", "nan"], "--rate nan: must be"),
        (["--queue", "-1"], "--queue -1: must be"),
        (["--split", "--link-loss", "2"], "--link-loss 2: must be from 0 to 1"),
        (["--link-mbit", "0"], "--link-mbit 0: must be"),
        (["--link-quality", "0"], "--link-quality 0: must be"),
        (["--link-latency-ms", "-5"], "--link-latency-ms -5: must be"),
        (["--drops", "dropped.json"], "--drops"),
        (["--mav", "folder"], "--mav"),
    ],
)
def test_invalid_options_give_a_one_line_error(
    words: list[str], named: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as exit_:
        cli.main(["live", "recording", "--out", str(out), *words])
    assert exit_.value.code == console.EXIT_ERROR
    (line,) = capsys.readouterr().err.splitlines()
    assert named in line
    assert not out.exists()


def test_any_option_of_the_radio_puts_a_radio_between_the_robots() -> None:
    def radio(*words: str) -> RadioLimits | None:
        verb = cli.parse("live", ["recording", "--out", "out", *words])
        assert isinstance(verb, Live)
        return verb.playback().radio

    assert radio() is None
    unlimited = RadioLimits(math.inf, 0.0, 0.0, 90)
    assert radio("--split") == unlimited
    assert radio("--link-loss", "0.1") == RadioLimits(math.inf, 0.0, 0.1, 90)
    assert radio("--link-mbit", "10", "--link-quality", "75") == RadioLimits(10.0, 0.0, 0.0, 75)
