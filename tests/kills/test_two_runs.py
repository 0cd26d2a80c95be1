"""Two processes of one command over one output: the second is refused, and nothing is mixed."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from evaluation.setup import console
from tests.kills.commands import VERBS, commands, make_inputs
from tests.kills.same import differences
from tests.kills.victim import Command

pytestmark = [
    pytest.mark.slow(minutes=1),
    pytest.mark.subject("evaluation", "sim", "airground"),
]
LONGEST_S = 900
SHORT = ("export", "run")
"""Verbs that may end before a second process has started; they are halted meanwhile."""


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inputs")
    make_inputs(folder)
    return folder


@pytest.mark.parametrize("verb", VERBS)
def test_two_at_once(verb: str, inputs: Path, tmp_path: Path) -> None:
    """They start together: one ends with 0, the other with 2 and one line."""
    words = commands(inputs)[verb]
    alone = Command(words, tmp_path / "alone")
    alone.folder.mkdir()
    alone.finish()
    shared = tmp_path / "shared"
    shared.mkdir()
    pair = [Command(words, shared, log=tmp_path / f"stderr-{k}") for k in range(2)]
    processes = [one.start() for one in pair]
    codes = [process.wait(LONGEST_S) for process in processes]
    assert sorted(codes) == [console.EXIT_OK, console.EXIT_ERROR]
    refused = pair[codes.index(console.EXIT_ERROR)]
    (line,) = [one for one in refused.errors().read_text().splitlines() if "error" in one]
    assert line.startswith(f"airground: error: --out {refused.output()}: ")
    assert {path.name for path in shared.iterdir()} == {"tmp", "out"}
    assert refused.temporary() == set()
    assert differences(verb, alone.output(), refused.output()) == []


@pytest.mark.parametrize("verb", VERBS)
def test_the_second_is_refused_before_it_works(verb: str, inputs: Path, tmp_path: Path) -> None:
    """It starts while the first one writes, and ends first."""
    first = Command(commands(inputs)[verb], tmp_path, log=tmp_path / "stderr-1")
    second = Command(first.words, tmp_path, log=tmp_path / "stderr-2")
    process = first.start()
    end = time.monotonic() + LONGEST_S
    while not (list(tmp_path.glob(".out.partial-*")) or (first.output() / ".lock").exists()):
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.01)
    if verb in SHORT:
        os.kill(process.pid, signal.SIGSTOP)
    try:
        assert second.start().wait(LONGEST_S) == console.EXIT_ERROR
    finally:
        os.kill(process.pid, signal.SIGCONT)
    assert "another run is writing" in second.errors().read_text()
    assert process.wait(LONGEST_S) == console.EXIT_OK
