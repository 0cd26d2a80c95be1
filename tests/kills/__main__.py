"""`python -m tests.kills --count N VERB ...`: signals at random moments, and what they leave.

Each kill is followed by the same command over the same name; after the last one it runs to the
end, and must write what a run without kills has written, and leave nothing else.
"""

from __future__ import annotations

import argparse
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

from tests.kills.commands import RESUMING, SAME, commands, make_inputs
from tests.kills.victim import Command, digest

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)


def main() -> int:
    words = argparse.ArgumentParser(prog="python -m tests.kills", description=__doc__)
    words.add_argument("verbs", nargs="*", default=list(SAME), help=", ".join(SAME))
    words.add_argument("--count", type=int, default=12, help="kills of each verb")
    words.add_argument("--seed", type=int, default=0, help="seed of the moments")
    asked = words.parse_args()
    # Ignored, as a shell sets it for what runs in the background, the commands would inherit it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    lost = 0
    with tempfile.TemporaryDirectory(prefix="airground-kills-") as name:
        folder = Path(name)
        make_inputs(folder)
        print("| verb | kills | while it ran | left after a kill | lost |\n|---|---|---|---|---|")
        for verb in asked.verbs:
            lost += kill_often(verb, commands(folder)[verb], folder, asked.count, asked.seed)
    return int(lost > 0)


def kill_often(verb: str, words: tuple[str, ...], folder: Path, count: int, seed: int) -> int:
    """Kill a verb `count` times, print a row of the table; returns the number of failures."""
    rng = np.random.default_rng([seed, sorted(SAME).index(verb)])
    good = Command(words, made(folder / f"{verb}-good"))
    whole_s = good.finish()
    expected = digest(good.output(), SAME[verb])
    victim = Command(words, made(folder / verb))
    left: Counter[str] = Counter()
    faults, hits, resumes = [], 0, False
    for k in range(count):
        number = SIGNALS[k % len(SIGNALS)]
        child = k if k % 4 == 3 and number is signal.SIGKILL else None
        began_s = time.monotonic()
        code, after = victim.kill(float(rng.uniform(0.2, 1.0)) * whole_s, number, child)
        hits += code != 0
        if code == 0 and not resumes:
            # The first run of all may have compiled kernels: moments are those of one that did not.
            whole_s = min(whole_s, time.monotonic() - began_s)
        for kind, names in vars(after).items():
            left[kind] += bool(names)
        for one in after.temporary:
            print(f"{verb}, {number.name}: left {one} in TMPDIR", file=sys.stderr, flush=True)
        faults += [f"{number.name}: process {one} stays" for one in after.processes]
        faults += [f"{number.name}: shared memory {one} stays" for one in after.shared]
        resumes = code != 0 and verb in RESUMING
        if not resumes:
            # Killed after its last step, a command has written all of it.
            if victim.whole() and digest(victim.output(), SAME[verb]) != expected:
                faults.append(f"{number.name}: exit code {code}, but the output looks whole")
            shutil.rmtree(victim.output(), ignore_errors=True)
    faults += ["no signal came while it ran"] if count and not hits else []
    victim.finish()
    beside = {path.name for path in victim.folder.iterdir()} - {"tmp", "stderr", victim.out}
    faults += [f"{one} stays after a whole run" for one in beside | victim.temporary()]
    same = digest(victim.output(), SAME[verb]) == expected
    faults += [] if same else ["the bytes differ from a run without kills"]
    said = ", ".join(f"{kind.replace('_', ' ')} {n}" for kind, n in left.items() if n) or "nothing"
    print(f"| {verb} | {count} | {hits} | {said} | {len(faults)} |", flush=True)
    for fault in faults:
        print(f"  {fault}", file=sys.stderr)
    return len(faults)


def made(folder: Path) -> Path:
    folder.mkdir()
    return folder


if __name__ == "__main__":
    sys.exit(main())
