"""`python -m tests.kills.disks --count N VERB ...`: commands whose disk fails them; needs root.

Output and temporary files lie on a small file system of their own, which is full at a random
moment, cannot be written, or loses the output's folder. What the command says must be one line with
exit code 2, and nothing may look whole; with enough room the same command then writes the same.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from evaluation.setup import console
from tests.kills.commands import RESUMING, VERBS, commands, make_inputs
from tests.kills.same import differences
from tests.kills.victim import Command

TROUBLES = ("full", "read-only", "vanishes")
ROOM, SPARE_BYTES = 3, 512 << 20
"""Enough is so many times what the output needs, and so much besides: temporary files lie beside
it, a flight's painted world among them."""


def main() -> int:
    words = argparse.ArgumentParser(prog="python -m tests.kills.disks", description=__doc__)
    words.add_argument("verbs", nargs="*", default=list(VERBS), help=", ".join(VERBS))
    words.add_argument("--count", type=int, default=5, help="times of each trouble and verb")
    words.add_argument("--seed", type=int, default=0, help="seed of sizes and moments")
    asked = words.parse_args()
    lost = 0
    with tempfile.TemporaryDirectory(prefix="airground-disks-") as name:
        folder = Path(name)
        make_inputs(folder)
        print("| verb | disk | tried | refused | lost |\n|---|---|---|---|---|")
        for verb in asked.verbs:
            lost += try_often(verb, folder, asked.count, asked.seed)
    return int(lost > 0)


def try_often(verb: str, folder: Path, count: int, seed: int) -> int:
    """Print a row for each trouble; returns the number of failures."""
    rng = np.random.default_rng([seed, sorted(VERBS).index(verb)])
    good = Command(commands(folder)[verb], folder / f"{verb}-good")
    good.folder.mkdir()
    good.finish()
    # How long it takes when nothing is compiled any more.
    warm = Command(good.words, folder / f"{verb}-warm")
    warm.folder.mkdir()
    whole_s = warm.finish()
    need = sum(path.stat().st_size for path in good.folder.rglob("*") if path.is_file())
    lost = 0
    for trouble in TROUBLES:
        faults: list[str] = []
        refused = 0
        for _ in range(count):
            with small_disk(folder, need) as disk:
                victim = Command(good.words, disk, log=folder / "stderr")
                code = suffer(victim, trouble, need, float(rng.uniform()), whole_s)
                refused += code != 0
                faults += what_is_wrong(victim, code, resumes=verb in RESUMING)
                remount(disk, f"rw,size={ROOM * need + SPARE_BYTES}")
                if code != 0:
                    victim.finish()
                faults += differences(verb, good.output(), victim.output())
        print(f"| {verb} | {trouble} | {count} | {refused} | {len(faults)} |", flush=True)
        for fault in faults:
            print(f"  {fault}", file=sys.stderr, flush=True)
        lost += len(faults)
    return lost


def suffer(victim: Command, trouble: str, need: int, share: float, whole_s: float) -> int:
    """Exit code of a command in trouble; `share` of 0 to 1 says how much fits, or when.
    A command that ended before its folder could vanish keeps it."""
    if trouble == "full":
        remount(victim.folder, f"size={int(need * (0.02 + 0.9 * share))}")
    elif trouble == "read-only":
        remount(victim.folder, "ro")
    process = victim.start()
    if trouble == "vanishes":
        time.sleep((0.2 + 0.7 * share) * whole_s)
        if process.poll() is not None:
            return process.returncode
        for path in victim.folder.iterdir():
            if path.name != "tmp":
                shutil.rmtree(path, ignore_errors=True)
    return process.wait(900)


def what_is_wrong(victim: Command, code: int, resumes: bool) -> list[str]:
    """Faults in what a command in trouble said and left; none if it succeeded."""
    if code == console.EXIT_OK:
        return []
    text = victim.errors().read_text("utf-8", "replace")
    lines = [line for line in text.splitlines() if line.startswith("airground: error: ")]
    faults = []
    if code != console.EXIT_ERROR or len(lines) != 1 or "Traceback" in text:
        faults.append(f"exit code {code}, {len(lines)} lines of error: {text[-400:]}")
    if victim.whole() and not resumes:
        faults.append(f"exit code {code}, but the output looks whole")
    return faults


@contextmanager
def small_disk(folder: Path, need: int) -> Iterator[Path]:
    """A file system in memory, gone with the block."""
    disk = Path(tempfile.mkdtemp(prefix="disk-", dir=folder))
    options = f"size={ROOM * need + SPARE_BYTES}"
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "none", disk], check=True)
    try:
        (disk / "tmp").mkdir()
        yield disk
    finally:
        subprocess.run(["umount", "--lazy", disk], check=True)
        disk.rmdir()


def remount(disk: Path, options: str) -> None:
    subprocess.run(["mount", "-o", f"remount,{options}", disk], check=True)


if __name__ == "__main__":
    sys.exit(main())
