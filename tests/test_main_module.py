"""`python -m airground` is the command `airground`."""

from __future__ import annotations

import subprocess
import sys
from importlib.metadata import EntryPoints

import pytest

from airground import __main__
from evaluation.setup import console


def test_it_answers_as_the_command_does() -> None:
    words = ["run", "no/such/recording", "--out", "no/such/out"]
    command = "from evaluation.cli import main; main()"
    module, direct = (
        subprocess.run([sys.executable, *how, *words], capture_output=True, text=True, check=False)
        for how in (["-m", "airground"], ["-c", command])
    )
    assert module.returncode == direct.returncode == console.EXIT_ERROR
    assert module.stderr == direct.stderr
    assert "no/such/recording" in module.stderr


def test_without_an_installation_it_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(__main__, "entry_points", lambda **_: EntryPoints())
    with pytest.raises(SystemExit) as ended:
        __main__.main()
    assert ended.value.code == console.EXIT_ERROR
    (line,) = capsys.readouterr().err.splitlines()
    assert "not installed" in line
