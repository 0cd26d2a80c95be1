"""`airground sweep`: wrong words at once, and a real sweep that is killed and run again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from airground.errors import InputError
from evaluation.commands.sweep import Sweep

WORDS = ["--vary", "localization.particles=50,100", "--scenes", "tiny", "--flights", "2"]
WORDS += ["--duration-s", "13", "--poses", "oracle"]
WORDS += ["--set", "protocol.sequences_per_flight=1", "--set", "protocol.trials=2"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({}, "name a dial"),
        ({"vary": ("scene.texture=2",)}, "out of its range"),
        ({"vary": ("scene.texture=1",), "flights": 0}, "--flights 0: must be at least 1"),
        ({"vary": ("scene.texture=1",), "duration_s": 0.0}, "--duration-s 0"),
        ({"vary": ("scene.texture=1",), "overrides": ("protocol.trials=0",)}, "protocol.trials"),
        ({"vary": ("scene.texture=1",), "overrides": ("protocol.baselines=1",)}, "no baselines"),
        (
            {"vary": ("scene.texture=1",), "overrides": ("protocol.only_images=true",)},
            "only_images: a sweep tries no baselines",
        ),
        ({"vary": ("scene.heap_height=1",), "scenes": ("flat",)}, r"no \[rubble\]"),
        ({"vary": ("scene.texture=1",), "scenes": ("nowhere",)}, "unknown scene 'nowhere'"),
    ],
)
def test_wrong_words_are_rejected_before_anything_is_done(
    words: dict[str, object], message: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=message):
        Sweep(out=tmp_path / "out", **words).main()  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def start(out: Path, threads: int) -> subprocess.Popen[bytes]:
    code = "from evaluation.cli import main; main()"
    words = ["sweep", *WORDS, "--threads", str(threads), "--out", str(out)]
    return subprocess.Popen([sys.executable, "-c", code, *words], stdout=subprocess.DEVNULL)


def results(out: Path) -> dict[str, bytes]:
    return {
        name: (out / name).read_bytes()
        for name in ("results.parquet", "sweep.json", "figures/sweep.png", "figures/sweep.pdf")
    }


@pytest.mark.slow(minutes=3)
@pytest.mark.subject(
    "evaluation/cli.py",
    "evaluation/commands",
    "evaluation/setup",
    "evaluation/table",
    "evaluation/measure",
    "evaluation/judge/sweep.py",
    "evaluation/show/sweep_results.py",
    but={"airground": "what is measured does not matter to what is kept", "sim": "likewise"},
)
def test_a_killed_sweep_ends_with_the_results_of_an_untouched_one(tmp_path: Path) -> None:
    untouched = start(tmp_path / "untouched", threads=2)
    assert untouched.wait() == 0
    out = tmp_path / "killed"
    killed = start(out, threads=1)
    while not list(out.glob("units/[0-9a-f]*")):  # the first of two flights
        assert killed.poll() is None
        time.sleep(0.1)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    kept = {
        unit: os.stat(unit / "rows.parquet").st_mtime_ns for unit in out.glob("units/[0-9a-f]*")
    }
    assert not (out / "results.parquet").exists()
    assert start(out, threads=1).wait() == 0
    assert results(out) == results(tmp_path / "untouched")
    assert len(list(out.glob("units/*"))) == 4
    for unit, written in kept.items():
        assert os.stat(unit / "rows.parquet").st_mtime_ns == written
