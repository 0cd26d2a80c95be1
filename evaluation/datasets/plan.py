"""What is to be in a dataset of many recordings, and which part each belongs to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import BaseModel, ConfigDict

from airground import __version__
from airground.errors import InputError
from airground.io.digests import bytes_digest
from sim.scene import load_scene
from sim.sensors.presets import sensor_preset

PLAN = "dataset.json"
"""The plan's file in the dataset."""
REST = "train"
MAX_SEEDS = 100_000


class World(BaseModel):
    """One recording of a dataset.

    Attributes:
        scene: Name or file of the scene.
        name: Its name.
        digest: SHA-256 of what the scene's file says.
        seed: Of the heap, the flight and the noise.
        part: Of the dataset.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
    scene: str
    name: str
    digest: str
    seed: int
    part: str

    @property
    def folder(self) -> str:
        """In the dataset."""
        return f"{self.part}/{self.name}_s{self.seed}"


class Plan(BaseModel):
    """All that decides what is in a dataset.

    Attributes:
        airground: The version that makes it.
        sensors: Name of the sensor preset.
        duration_s: Of each recording; the scenes' own if None.
        worlds: The recordings.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")
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
        InputError: A name or a share cannot be.
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
    """Every scene with every seed; each world is in one part only.

    Raises:
        InputError: A scene or the sensors are unknown, or two scenes have the same name.
    """
    sensor_preset(sensors)
    loaded = {scene: load_scene(scene) for scene in scenes}
    names = [scene.name for scene in loaded.values()]
    if len(set(names)) < len(scenes):
        raise InputError(f"two scenes have the same name: {', '.join(sorted(names))}")
    worlds = [(scene, seed) for scene in scenes for seed in seeds]
    # A generator of its own: another sensor preset shall not move worlds to another part.
    order = np.random.default_rng(0).permutation(len(worlds)).tolist()
    parts = [REST] * len(worlds)
    for part, share in shares.items():
        taken, order = order[: round(share * len(worlds))], order[round(share * len(worlds)) :]
        for index in taken:
            parts[index] = part
    return Plan(
        sensors=sensors,
        duration_s=duration_s,
        worlds=tuple(
            World(
                scene=scene,
                name=loaded[scene].name,
                digest=bytes_digest(loaded[scene].model_dump_json().encode()),
                seed=seed,
                part=part,
            )
            for (scene, seed), part in zip(worlds, parts, strict=True)
        ),
    )
