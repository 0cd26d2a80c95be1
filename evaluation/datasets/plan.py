"""The plan of a dataset of many recordings: its worlds, and the part that each belongs to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from airground import __version__
from airground.errors import InputError
from airground.io.digests import bytes_digest
from evaluation.setup.checked_json import Part
from sim.scene import load_scene
from sim.sensors.presets import sensor_preset

PLAN = "dataset.json"
"""The plan's file in the dataset."""
REST = "train"
"""The part of all worlds that no share takes."""
MAX_SEEDS = 100_000
"""Seeds in one range: more are a typing error."""


class World(Part):
    """One recording of a dataset: name or file of the scene, its name, SHA-256 of its contents."""

    scene: str
    name: str
    digest: str
    seed: int
    part: str

    @property
    def folder(self) -> str:
        return f"{self.part}/{self.name}_s{self.seed}"


class Plan(Part):
    """All that determines the contents of a dataset; without duration, the scenes' own are used."""

    airground: str = __version__
    sensors: str
    duration_s: float | None
    worlds: tuple[World, ...]


def parse_seeds(text: str) -> list[int]:
    """Seeds from text such as "0-9" or "1,4,10-12", ascending.

    Raises:
        InputError: The text is no such list.
    """
    seeds: set[int] = set()
    for piece in text.split(","):
        first, _, last = piece.partition("-")
        last = last or first
        if not (first.isdecimal() and last.isdecimal()) or len(piece) > 30:
            raise InputError(f"--seeds {text[:60]}: expected a list such as 0-9 or 1,4,10-12")
        if not 0 <= int(last) - int(first) < MAX_SEEDS:
            raise InputError(f"--seeds {piece}: expected at most {MAX_SEEDS}, the lower one first")
        seeds |= set(range(int(first), int(last) + 1))
    return sorted(seeds)


def parse_split(texts: Sequence[str]) -> dict[str, float]:
    """Shares by the name of the part, from texts such as "test=0.2"; the rest is "train".

    Raises:
        InputError: A name or a share is not valid.
    """
    shares: dict[str, float] = {}
    for text in texts:
        name, _, share = text.partition("=")
        try:
            shares[name] = float(share)
        except ValueError:
            raise InputError(f"--split {text}: expected a name and a share: test=0.2") from None
        if not (name.isidentifier() and name != REST and 0 < shares[name] < 1):
            raise InputError(f"--split {text}: expected a name and a share below 1: test=0.2")
    if sum(shares.values()) >= 1:
        raise InputError(f"--split: nothing is left for {REST}")
    return shares


def plan_dataset(
    scenes: Sequence[str],
    seeds: Sequence[int],
    shares: dict[str, float],
    sensors: str,
    duration_s: float | None,
) -> Plan:
    """Plan every scene with every seed; each world is in one part only.

    Raises:
        InputError: A scene or the sensors are unknown, or two scenes have the same name.
    """
    sensor_preset(sensors)
    loaded = {scene: load_scene(scene) for scene in scenes}
    names = [scene.name for scene in loaded.values()]
    if len(set(names)) < len(scenes):
        raise InputError(f"two scenes have the same name: {', '.join(sorted(names))}")
    pairs = [(scene, seed) for scene in scenes for seed in seeds]
    # A generator of its own, so that another sensor preset does not move worlds between parts.
    order = np.random.default_rng(0).permutation(len(pairs)).tolist()
    parts = [REST] * len(pairs)
    for part, share in shares.items():
        count = round(share * len(pairs))
        taken, order = order[:count], order[count:]
        for index in taken:
            parts[index] = part
    digests = {scene: bytes_digest(one.model_dump_json().encode()) for scene, one in loaded.items()}
    worlds = tuple(
        World(scene=scene, name=loaded[scene].name, digest=digests[scene], seed=seed, part=part)
        for (scene, seed), part in zip(pairs, parts, strict=True)
    )
    return Plan(sensors=sensors, duration_s=duration_s, worlds=worlds)
