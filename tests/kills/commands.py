"""The commands that are killed, over the smallest flight."""

from __future__ import annotations

from pathlib import Path

from tests.kills.victim import Command
from tests.sim.small_flight import SCENE

QUICK = ("protocol.sequences_per_flight=1", "protocol.trials=2")
VERBS = ("simulate", "export", "run", "live", "sweep", "reproduce")
RESUMING = ("sweep", "reproduce")
"""Verbs that go on in an unfinished output."""


def commands(folder: Path) -> dict[str, tuple[str, ...]]:
    """Words of each verb; `folder` holds what `make_inputs` made."""
    scene, recording = str(folder / "small.toml"), str(folder / "recording")
    sets = tuple(word for one in QUICK for word in ("--set", one))
    oracle = ("--poses", "oracle")
    flights = ("--scenes", scene, "--flights", "1", *oracle, *sets)
    return {
        "simulate": ("simulate", scene, "--threads", "2"),
        "export": ("export", recording, "--format", "euroc"),
        "run": ("run", recording, *oracle),
        # No image is dropped however slow the machine is: results depend on what is dropped.
        "live": ("live", recording, "--rate", "2", "--queue", "100000"),
        "sweep": ("sweep", "--vary", "localization.particles=50,80", *flights),
        "reproduce": ("reproduce", "--alone", *flights, "--set", "protocol.baselines=0"),
    }


def make_inputs(folder: Path) -> None:
    """Write the scene and the recording that the commands read."""
    scene = SCENE.replace("takeoff_s = 1.6", "takeoff_s = 0.2").replace("= 5.0\n", "= 3.4\n", 1)
    (folder / "small.toml").write_text(scene)
    Command(commands(folder)["simulate"], folder, "recording").finish()
