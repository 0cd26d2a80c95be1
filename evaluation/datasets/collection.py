"""Many recordings as one dataset, split by world, made in parallel and resumed where it stopped.

    NAME/dataset.json    the plan: what is in it, and how it was made
    NAME/DATASHEET.md    the same for people
    NAME/PART/SCENE_sSEED/    recordings; PART is train or a part that was asked for

Until all are made the folder is called `.NAME.partial`. Recordings appear there when they are
whole, so that whatever ends the work, the next call only makes what is missing.
"""

from __future__ import annotations

import fcntl
import json
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import BaseModel, ConfigDict
from rich.progress import track

from airground import __version__
from airground.errors import AirgroundError, InputError
from airground.io.digests import bytes_digest
from evaluation.checked_json import read_checked
from evaluation.datasets.datasheet import datasheet
from evaluation.output import check_free
from evaluation.workers import outcomes
from sim.interrupts import end_with_parent
from sim.presets import sensor_preset
from sim.recorder import record
from sim.scene import Scene, load_scene

PLAN, SHEET, LOCK = "dataset.json", "DATASHEET.md", ".lock"
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


def make_dataset(plan: Plan, out: Path, jobs: int, threads: int) -> None:
    """Make what is missing of a dataset; nothing is made twice.

    Args:
        plan: What is to be in it.
        out: The folder to make; it appears when it is whole.
        jobs: Recordings at a time.
        threads: Processes that render, over all of them.

    Raises:
        InputError: The folder exists, or an unfinished one is of another plan, or in work.
        AirgroundError: A recording cannot be made; those that are stay for the next call.
    """
    check_free(out)
    unfinished = out.parent / f".{out.name}.partial"
    with _held(unfinished):
        _agree(unfinished, plan)
        missing = [w for w in plan.worlds if not (unfinished / w.folder).exists()]
        each = max(1, threads // jobs)
        tasks = [_Making(world, plan, unfinished, each) for world in missing]
        done = outcomes(_make, tasks, jobs)
        for _ in track(done, "recording", total=len(tasks), transient=True):
            pass
        recordings = [(world.part, unfinished / world.folder) for world in plan.worlds]
        scenes = [load_scene(scene) for scene in dict.fromkeys(w.scene for w in plan.worlds)]
        sheet = datasheet(out.name, scenes, sensor_preset(plan.sensors), recordings)
        (unfinished / SHEET).write_text(sheet, encoding="utf-8")
        (unfinished / LOCK).unlink()
        unfinished.rename(out)


@contextmanager
def _held(unfinished: Path) -> Iterator[None]:
    """The folder, for this process alone."""
    unfinished.mkdir(parents=True, exist_ok=True)
    with (unfinished / LOCK).open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f"{unfinished}: another process works on it") from None
        yield


def _agree(unfinished: Path, plan: Plan) -> None:
    """Note the plan, or see that it is the one noted; sweep away what was cut short."""
    noted = unfinished / PLAN
    if not noted.exists():
        text = json.dumps(plan.model_dump(), indent=1) + "\n"
        partial = unfinished / f"{PLAN}.partial"
        partial.write_text(text, encoding="utf-8")
        partial.rename(noted)
    elif read_checked(Plan, noted, "plan of a dataset") != plan:
        raise InputError(
            f"{unfinished}: is the unfinished work of another plan or version; remove it, or "
            "give the same words"
        )
    for cut_short in unfinished.glob("*/.*.partial"):
        shutil.rmtree(cut_short)


@dataclass(frozen=True)
class _Making:
    world: World
    plan: Plan
    folder: Path
    workers: int


def _make(task: _Making) -> None:
    """Runs in a process of its own, which must not outlive the one that holds the folder."""
    end_with_parent()
    world, plan = task.world, task.plan
    scene: Scene = load_scene(world.scene)
    out = task.folder / world.folder
    try:
        record(
            scene,
            world.seed,
            sensor_preset(plan.sensors),
            out,
            plan.duration_s,
            task.workers,
            quiet=True,
        )
    except AirgroundError as error:
        raise AirgroundError(f"{world.name}, seed {world.seed}: {error}") from None
