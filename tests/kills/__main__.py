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
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from evaluation.setup.console import EXIT_INTERNAL
from tests.kills.commands import RESUMING, VERBS, commands, make_inputs
from tests.kills.roles import Role
from tests.kills.same import differences, lacks_a_robot
from tests.kills.victim import Command, Left

SIGNALS = ("KILL", "TERM", "INT")
TARGETS = (Role.PARENT, Role.WORKER, Role.RENDERER)
"""Those of SIGKILL, in turn; SIGTERM goes to the parent, and Ctrl-C to all as a terminal's does."""
COLUMNS = ("verb", "signals", "while it ran: SIGKILL", "SIGTERM", "Ctrl-C", "left", "lost")


def main() -> int:
    words = argparse.ArgumentParser(prog="python -m tests.kills", description=__doc__)
    words.add_argument("verbs", nargs="*", default=list(VERBS), help=", ".join(VERBS))
    words.add_argument("--count", type=int, default=12, help="signals to each verb")
    words.add_argument("--seed", type=int, default=0, help="seed of the moments")
    words.add_argument("--signal", choices=SIGNALS, help="only this one, not all in turn")
    words.add_argument("--keep", type=Path, help="folder for outputs that differ")
    asked = words.parse_args()
    # Ignored, as a shell sets it for what runs in the background, the commands would inherit it.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signals = [signal.Signals[f"SIG{name}"] for name in SIGNALS if asked.signal in (None, name)]
    lost = 0
    with tempfile.TemporaryDirectory(prefix="airground-kills-") as name:
        folder = Path(name)
        make_inputs(folder)
        print(f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}", flush=True)
        for verb in asked.verbs:
            campaign = Campaign(verb, commands(folder)[verb], folder, signals, asked.keep)
            campaign.run(asked.count, np.random.default_rng([asked.seed, VERBS.index(verb)]))
            print(campaign.row(asked.count), flush=True)
            for fault in campaign.faults:
                print(f"  {fault}", file=sys.stderr, flush=True)
            lost += len(campaign.faults)
    return int(lost > 0)


@dataclass
class Campaign:
    """Signals to one verb, and what they left.

    Attributes:
        verb, words: The command.
        folder: Folder of its inputs, and of its outputs.
        signals: Signals that are sent in turn.
        keep: Folder to which outputs that differ are copied; None for nowhere.
        hits: Signals that met a running process, by signal and role.
        left: Kinds of what was left, each counted once a signal.
        faults: What must not be.
    """

    verb: str
    words: tuple[str, ...]
    folder: Path
    signals: list[signal.Signals]
    keep: Path | None = None
    hits: Counter[tuple[signal.Signals, Role]] = field(default_factory=Counter)
    left: Counter[str] = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)

    def run(self, count: int, rng: np.random.Generator) -> None:
        """Signal the command `count` times, then let it end."""
        good = Command(self.words, made(self.folder / f"{self.verb}-good"))
        whole_s = good.finish()
        victim = Command(self.words, made(self.folder / self.verb))
        resumes = False
        for k in range(count):
            number = self.signals[k % len(self.signals)]
            began_s = time.monotonic()
            code, hit, left = victim.kill(
                float(rng.uniform(0.1, 1.0)) * whole_s, number, self.target(k, number), k
            )
            if hit is None and not resumes:
                # The first run of all may have compiled kernels: moments are those of one that
                # did not.
                whole_s = min(whole_s, time.monotonic() - began_s)
            self.note(number, hit, left)
            if code == EXIT_INTERNAL:
                self.faults.append(f"{number.name}: an internal error")
            resumes = self.verb in RESUMING and victim.whole() and code != 0
            if not resumes:
                if victim.whole() and lacks_a_robot(victim.output()):
                    self.left["without_a_robot"] += 1
                elif victim.whole():
                    # Killed after its last step, or its worker replaced, it has written all.
                    wrong = self.compare(good, victim, f"{k}")
                    said = f"{number.name}, exit code {code}: the output looks whole, but"
                    self.faults += [f"{said} {one}" for one in wrong]
                shutil.rmtree(victim.output(), ignore_errors=True)
        if count and not self.hits:
            self.faults.append("no signal came while it ran")
        left_before = victim.beside()
        victim.finish()
        self.check_end(victim, left_before)
        self.faults += self.compare(good, victim, "end")

    def compare(self, good: Command, victim: Command, when: str) -> list[str]:
        """Differences of two outputs, which are kept if there are any."""
        wrong = differences(self.verb, good.output(), victim.output())
        if wrong and self.keep is not None:
            for one in (good, victim):
                shutil.copytree(one.output(), self.keep / f"{one.folder.name}-{when}")
        return wrong

    def target(self, k: int, number: signal.Signals) -> Role:
        """Which process gets signal number k."""
        if number is signal.SIGKILL:
            return TARGETS[k // len(self.signals) % len(TARGETS)]
        return Role.GROUP if number is signal.SIGINT else Role.PARENT

    def note(self, number: signal.Signals, hit: Role | None, left: Left) -> None:
        """Count a signal, and what it left."""
        if hit is not None:
            self.hits[number, hit] += 1
        for kind, names in vars(left).items():
            self.left[kind] += bool(names)
        for one in left.temporary:
            print(f"{self.verb}, {number.name}: left {one} in TMPDIR", file=sys.stderr, flush=True)
        self.faults += [f"{number.name}: process {one} stays" for one in left.processes]
        self.faults += [f"{number.name}: shared memory {one} stays" for one in left.shared]
        if number is not signal.SIGKILL:
            self.faults += [f"{number.name}: {one} stays" for one in left.half_written]

    def check_end(self, victim: Command, left_before: set[str]) -> None:
        """After a whole run nothing is left beside its output, and it has said what was."""
        left = victim.beside() | victim.temporary()
        self.faults += [f"{one} stays after a whole run" for one in left]
        said = victim.errors().read_text("utf-8", "replace")
        self.faults += [f"{one} was removed silently" for one in left_before if one not in said]

    def row(self, count: int) -> str:
        """The row of the table."""
        hits = [self.by_role(one) for one in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)]
        left = [f"{kind.replace('_', ' ')} {n}" for kind, n in self.left.items() if n]
        cells = [self.verb, str(count), *hits, ", ".join(left) or "nothing", str(len(self.faults))]
        return f"| {' | '.join(cells)} |"

    def by_role(self, number: signal.Signals) -> str:
        """How often a signal met which process: "parent 3, worker 2"."""
        counts = [f"{role.value} {self.hits[number, role]}" for role in Role]
        return ", ".join(one for one in counts if not one.endswith(" 0")) or "none"


def made(folder: Path) -> Path:
    folder.mkdir()
    return folder


if __name__ == "__main__":
    sys.exit(main())
