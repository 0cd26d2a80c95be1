"""Many recordings as one dataset, split by world, made in parallel and resumed where it stopped.
Until all are made the folder is called `.NAME.partial`. Recordings appear in it when they are
complete: after an interruption the next call makes only what is missing."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from airground.core.scratch_folder import ScratchFolder
from airground.errors import AirgroundError, InputError
from evaluation.datasets.datasheet import datasheet
from evaluation.datasets.plan import PLAN, Plan, World
from evaluation.measure.work.crew import Crew
from evaluation.setup.checked_json import read_checked
from evaluation.setup.output import check_free, continued_folder, write_whole
from evaluation.setup.progress import step
from sim.interrupts import end_with_parent
from sim.recording.recorder import record
from sim.scene import load_scene
from sim.sensors.presets import sensor_preset

SHEET = "DATASHEET.md"


def make_dataset(plan: Plan, out: Path, jobs: int, threads: int) -> None:
    """Make what is missing of a dataset; nothing is made twice.

    `out` appears when it is complete; `threads` processes render, over all jobs.

    Raises:
        InputError: The folder exists, or an unfinished one has another plan, or is in use.
        AirgroundError: A recording cannot be made; finished ones remain for the next call.
    """
    check_free(out)
    unfinished = out.parent / f".{out.name}.partial"
    with continued_folder(unfinished):
        _agree(unfinished, plan)
        missing = [w for w in plan.worlds if not (unfinished / w.folder).exists()]
        each = max(1, threads // jobs)
        tasks = [_Making(world, plan, unfinished, each) for world in missing]
        done = len(plan.worlds) - len(missing)
        with (
            ScratchFolder() as scratch,
            Crew(None, jobs, len(tasks), scratch.path) as crew,
            step("recording", len(plan.worlds), "worlds", done) as recording,
        ):
            for _, refusal in crew.outcomes(_make, tasks):
                if refusal is not None:
                    raise AirgroundError(refusal)
                recording.advance()
        recordings = [(world.part, unfinished / world.folder) for world in plan.worlds]
        scenes = [load_scene(scene) for scene in dict.fromkeys(w.scene for w in plan.worlds)]
        sheet = datasheet(out.name, scenes, sensor_preset(plan.sensors), recordings)
        (unfinished / SHEET).write_text(sheet, encoding="utf-8")
        unfinished.rename(out)


def _agree(unfinished: Path, plan: Plan) -> None:
    """Write the plan, or check that it is the written one."""
    written = unfinished / PLAN
    if not written.exists():
        text = json.dumps(plan.model_dump(), indent=1) + "\n"
        write_whole(written, text)
    elif read_checked(Plan, written, "plan of a dataset") != plan:
        raise InputError(
            f"{unfinished}: is the unfinished work of another plan or version; remove it, or "
            "give the same words"
        )


@dataclass(frozen=True)
class _Making:
    world: World
    plan: Plan
    folder: Path
    workers: int


def _make(task: _Making) -> str | None:
    """Record one world, in a process that ends with its parent; returns why it cannot."""
    end_with_parent()
    world, plan = task.world, task.plan
    out = task.folder / world.folder
    if out.exists():  # by a worker that died before it returned
        return None
    try:
        record(
            load_scene(world.scene),
            world.seed,
            sensor_preset(plan.sensors),
            out,
            plan.duration_s,
            task.workers,
        )
    except AirgroundError as error:
        return f"{world.name}, seed {world.seed}: {error}"
    return None
